# SPDX-License-Identifier: GPL-3.0-or-later
"""A finding: one thing about a mission that its pilot must hear of."""

from collections.abc import Callable
from dataclasses import dataclass

from protocols.mission_item import MissionItem, MissionResult

DROPPED = "dropped"
REJECTED = "rejected"
CLEARED = "cleared"

_STATUSTEXT_LENGTH = 50
_LABELS = {"lat_e7": "lat", "lon_e7": "lon", "alt_m": "height"}

#: Makes a finding of an item: field, value as sent, what it becomes, why.
Note = Callable[[MissionItem, str, float | None, float | str | None, str], None]


@dataclass(frozen=True, slots=True)
class Finding:
    """A changed value, a dropped item or a rejected list (mission-rules.md).

    `seq` is the item's number as it was sent; None speaks of the whole list. `field` is an attribute of MissionItem,
    or "count". `was` is the value as sent, None if not given; `becomes` the value as stored, or DROPPED (the item),
    REJECTED or CLEARED (the list).
    """

    seq: int | None
    field: str
    was: str | float | int | None
    becomes: str | float | int | None
    why: str

    def text(self) -> str:
        """Say it in one line; a change leaves its reason out where a STATUSTEXT has no room for it."""
        full = self.full_text()
        if isinstance(self.becomes, str) or len(full) <= _STATUSTEXT_LENGTH:
            return full
        return full.removesuffix(f" ({self.why})")

    def full_text(self) -> str:
        """Say it in one line, with the reason."""
        who = "Mission" if self.seq is None else f"WP {self.seq}" if self.seq else "Home"
        if isinstance(self.becomes, str):
            return f"{who}: {self.becomes}, {self.why}"
        label = _LABELS.get(self.field, self.field)
        unit = " m" if self.field == "alt_m" else ""
        return f"{who}: {label} {self._shown(self.was)} -> {self._shown(self.becomes)}{unit} ({self.why})"

    def _shown(self, value: str | float | int | None) -> str:
        if value is None:
            return "none"
        if isinstance(value, str):
            return value
        if self.field in ("lat_e7", "lon_e7"):
            return f"{value / 1e7:.7f}" if value else "0"
        return f"{value:g}"


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why a list is refused: the answer to the ground station, and the words for its user."""

    ack: MissionResult
    finding: Finding


def reject(ack: MissionResult, seq: int | None, name: str, was: float | None, why: str) -> Rejection:
    """Make a rejection of the list because of item `seq`."""
    return Rejection(ack, Finding(seq, name, was, REJECTED, why))
