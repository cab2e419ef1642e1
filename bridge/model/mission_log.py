# SPDX-License-Identifier: GPL-3.0-or-later
"""What is remembered of every mission that comes in."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from bridge.model.verdict import Verdict
from protocols.mission_item import MissionItem


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
class Conclusion:
    """How it ended, with one sentence of detail."""

    outcome: Outcome
    detail: str
