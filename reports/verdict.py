# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of checking a mission list."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Generic, TypeVar

from protocols.mission_item import MissionItem, MissionRecord, MissionResult
from reports.finding import Finding, RejectingFinding

#: For each item of a list as stored and read back, the item's number as sent, or None if it was inserted (a speed).
#: Rules drop, insert and merge items. A station that sent a list counts by its own numbers until it reads the list
#: back, so it is shown those. Empty: the same numbers.
SentSeqs = tuple[int | None, ...]
RecordT = TypeVar("RecordT", bound=MissionRecord)


class Result(Enum):
    """The possible results of a check."""

    ACCEPTED = auto()
    CLEARED = auto()
    REJECTED = auto()


@dataclass(frozen=True, slots=True)
class FlownLeg:
    """A leg of the flight, for drawings. seq: of the item flown to, as read back; start, end: degrees * 1e7.

    Heights are in metres above home, None if unknown. A landing is a leg without length.
    """

    seq: int
    start: tuple[int, int]
    end: tuple[int, int]
    length_m: float
    start_m: float | None
    end_m: float | None
    is_return: bool = False


@dataclass(frozen=True, slots=True)
class Verdict(Generic[RecordT]):
    """A checked list.

    `records` is the list for the flight controller, `items` the same as read back; both empty unless ACCEPTED.
    `sent_as` maps a record's place to the MAV_CMD that it was sent as, where the record is ambiguous (a region of
    interest, a hold). `flight`: length, heights and end in words. `path`: the legs, also of a list rejected for them.
    `assumed`: what the rules had to assume about board and craft. `findings` are in the order of the list. That of a
    rejection is the last.
    """

    result: Result
    ack: MissionResult
    records: tuple[RecordT, ...] = ()
    items: tuple[MissionItem, ...] = ()
    findings: tuple[Finding, ...] = ()
    sent_as: Mapping[int, int] = field(default_factory=dict)
    sent_seqs: SentSeqs = ()
    flight: tuple[str, ...] = ()
    path: tuple[FlownLeg, ...] = ()
    assumed: tuple[str, ...] = ()


def is_renumbered(sent_seqs: SentSeqs) -> bool:
    """True if an item of the list as read back has another number than it was sent with."""
    return sent_seqs != tuple(range(len(sent_seqs)))


#: The verdict on a list without items.
CLEARED_LIST: Verdict[Any] = Verdict(Result.CLEARED, MissionResult.ACCEPTED)


def rejected(findings: tuple[Finding, ...], rejection: RejectingFinding) -> Verdict[Any]:
    return Verdict(Result.REJECTED, rejection.ack, findings=(*findings, rejection.finding))
