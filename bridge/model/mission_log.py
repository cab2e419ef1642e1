# SPDX-License-Identifier: GPL-3.0-or-later
"""What is remembered of every mission that comes in."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from bridge.model.verdict import Verdict
from protocols.mission_item import MissionItem
from protocols.mission_record import ListIdentity


class Outcome(Enum):
    """What became of a mission, as stored."""

    PENDING = "PENDING"
    VERIFIED = "VERIFIED"  # the flight controller holds it, checksum read back
    REJECTED = "REJECTED"  # by the rules; the flight controller was not touched
    CANCELLED = "CANCELLED"  # by the ground station, or it fell silent
    FAILED = "FAILED"  # the flight controller refused it or was not reachable


@dataclass(frozen=True, slots=True)
class ArrivedMission:
    """A mission as it came in: from whom, the items as sent, and what the rules said."""

    source: str
    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]


@dataclass(frozen=True, slots=True)
class PendingMission:
    """A mission of which it is not known whether the flight controller has it.

    `number`: in the store, None if it is not stored. `identity`: of the list to look for, None if it was rejected.
    `before`: of the list that was there before, None if that is not known.
    """

    number: int | None
    identity: ListIdentity | None
    before: ListIdentity | None = None


@dataclass(frozen=True, slots=True)
class Conclusion:
    """How it ended, with one sentence of detail."""

    outcome: Outcome
    detail: str
