# SPDX-License-Identifier: GPL-3.0-or-later
"""How a mission list is judged, whatever the flight controller: item by item, by the rules that its dialect brings.

One controller's rules are a `MissionRules` and its `ListCheck`; `bridge.controllers.harakiri.check` is an example.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from bridge.model.finding import Finding, Rejection, reject
from bridge.model.verdict import CLEARED_LIST, Verdict, rejected
from protocols.mission_item import Frame, MissionItem, MissionResult

MAX_LAT_E7 = 90 * 10**7
MAX_LON_E7 = 180 * 10**7
RELATIVE_FRAMES = (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT)
SEA_LEVEL_FRAMES = (Frame.GLOBAL, Frame.GLOBAL_INT)
TERRAIN_FRAMES = (Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT)


class ListCheck(ABC):
    """The check of one list. `count` items will come, in order; an item's number is its place in that order."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._taken = 0
        self._findings: list[Finding] = []
        self._rejection: Rejection | None = None

    def take(self, item: MissionItem) -> Rejection | None:
        """Judge the next item; a rejection is final and comes with the first item that proves it."""
        if self._rejection is None:
            item = replace(item, seq=self._taken)
            self._taken += 1
            self._rejection = self._judge(item)
        return self._rejection

    def finish(self) -> Verdict[Any]:
        """Return the verdict, with the rules for what is kept; ValueError if items are still to come."""
        if self._rejection is None and self._taken < self._count:
            raise ValueError(f"{self._taken} of {self._count} items taken")
        rejection = self._rejection or self._refuse_kept_list()
        return rejected(tuple(self._findings), rejection) if rejection else self._conclude()

    @abstractmethod
    def _judge(self, item: MissionItem) -> Rejection | None:
        """Keep or drop the item, or find what rejects the list as soon as it is seen."""

    @abstractmethod
    def _refuse_kept_list(self) -> Rejection | None:
        """Find what rejects the list now that all of it is there."""

    @abstractmethod
    def _conclude(self) -> Verdict[Any]:
        """Return the verdict on a list that is not rejected."""

    def _note(self, item: MissionItem, name: str, was: float | None, becomes: float | str | None, why: str) -> None:
        self._findings.append(Finding(item.seq, name, was, becomes, why))


class MissionRules(Protocol):
    """What a flight controller can hold. A profile: it knows the list's limits, and begins the check of a list."""

    @property
    def max_items(self) -> int:
        """The longest list that may fit, home included."""

    def begin(self, count: int, fallback_home: tuple[int, int] | None) -> ListCheck:
        """Begin a list of `count` items; `fallback_home` (lat_e7, lon_e7) stands in for a home without coordinates."""


def check_count(count: int, rules: MissionRules) -> Rejection | None:
    """Judge a MISSION_COUNT; 0 clears the list and is no fault."""
    if count == 1:
        return reject(MissionResult.INVALID, None, "count", count, "only a home point, no command")
    if count > rules.max_items:
        why = f"{count} items, {rules.max_items} fit"
        return reject(MissionResult.NO_SPACE, None, "count", count, why)
    return None


def check_list(
    items: Sequence[MissionItem], rules: MissionRules, fallback_home: tuple[int, int] | None = None
) -> Verdict[Any]:
    """Judge a whole list; without items it clears the flight controller's."""
    if not items:
        return CLEARED_LIST
    if rejection := check_count(len(items), rules):
        return rejected((), rejection)
    check = rules.begin(len(items), fallback_home)
    for item in items:
        if check.take(item):
            break
    return check.finish()


def refuse_frame(item: MissionItem, *, needs_position: bool) -> Rejection | None:
    """Refuse a frame in which no place can be understood; MISSION will do where none is used."""
    known = item.frame in (*RELATIVE_FRAMES, *SEA_LEVEL_FRAMES, *TERRAIN_FRAMES)
    if known or (item.frame == Frame.MISSION and not needs_position):
        return None
    why = f"frame {item.frame} is not supported"
    return reject(MissionResult.UNSUPPORTED_FRAME, item.seq, "frame", item.frame, why)


def refuse_position(item: MissionItem) -> Rejection | None:
    """Refuse coordinates that are nowhere on earth."""
    if abs(item.lat_e7 or 0) > MAX_LAT_E7:
        why = "latitude beyond 90 degrees"
        return reject(MissionResult.INVALID_PARAM5_X, item.seq, "lat_e7", item.lat_e7, why)
    if abs(item.lon_e7 or 0) > MAX_LON_E7:
        why = "longitude beyond 180 degrees"
        return reject(MissionResult.INVALID_PARAM6_Y, item.seq, "lon_e7", item.lon_e7, why)
    return None


def missing_coordinate(item: MissionItem) -> tuple[str, int | None] | None:
    """Name the coordinate that is not given, and what stands in its place; None if both are there."""
    if item.lat_e7 and item.lon_e7:
        return None
    return ("lon_e7", item.lon_e7) if item.lat_e7 else ("lat_e7", item.lat_e7)


def given(value: float) -> float | None:
    """Return None for what is not given."""
    return None if math.isnan(value) else value
