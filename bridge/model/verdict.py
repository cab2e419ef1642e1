# SPDX-License-Identifier: GPL-3.0-or-later
"""What a checked mission list comes to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, Generic, TypeVar

from bridge.model.finding import Finding, Rejection
from protocols.mission_item import MissionItem, MissionResult
from protocols.mission_record import MissionRecord

RecordT = TypeVar("RecordT", bound=MissionRecord)


class Result(Enum):
    """What becomes of a list."""

    ACCEPTED = auto()
    CLEARED = auto()
    REJECTED = auto()


@dataclass(frozen=True, slots=True)
class Verdict(Generic[RecordT]):
    """A checked list.

    `records` is what the flight controller is to hold, `items` the same as it reads back, both empty unless ACCEPTED.
    `sent_as` maps a record's place to the MAV_CMD with which it was sent, where the record does not tell (a region of
    interest). `findings` come in the order of the list; that of a rejection is the last.
    """

    result: Result
    ack: MissionResult
    records: tuple[RecordT, ...] = ()
    items: tuple[MissionItem, ...] = ()
    findings: tuple[Finding, ...] = ()
    sent_as: Mapping[int, int] = field(default_factory=dict)


#: What a list without items comes to.
CLEARED_LIST: Verdict[Any] = Verdict(Result.CLEARED, MissionResult.ACCEPTED)


def rejected(findings: tuple[Finding, ...], rejection: Rejection) -> Verdict[Any]:
    """Return the verdict on a list that is refused."""
    return Verdict(Result.REJECTED, rejection.ack, findings=(*findings, rejection.finding))
