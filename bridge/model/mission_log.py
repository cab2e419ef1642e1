# SPDX-License-Identifier: GPL-3.0-or-later
"""The stored record of a received mission."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from protocols.mission_item import MissionItem
from protocols.mission_record import ListIdentity
from reports.verdict import SentSeqs, Verdict


class Outcome(Enum):
    """The outcome of a mission, as stored."""

    PENDING = "PENDING"
    VERIFIED = "VERIFIED"  # the flight controller holds it, checksum read back
    REJECTED = "REJECTED"  # by the rules; the flight controller was not touched
    CANCELLED = "CANCELLED"  # by the ground station, or by its timeout
    FAILED = "FAILED"  # the flight controller refused it or was not reachable


@dataclass(frozen=True, slots=True)
class ArrivedMission:
    """A mission as received: its source as text, the items as sent, and the verdict.

    `sender`: Sender.identity of the ground station; empty for other sources. `is_home_meant`: True if item 0 is surely
    home, whatever its frame, asked at the end.
    """

    source: str
    items: tuple[MissionItem, ...]
    verdict: Verdict[Any]
    sender: str = ""
    is_home_meant: Callable[[], bool] = lambda: False


@dataclass(frozen=True, slots=True)
class RecalledMission:
    """The store's facts about a list that was verified before.

    `sent_as`: the commands that ambiguous records were sent with, by record number. `sent_seqs`: the item numbers of
    each ground station that sent it and has not read it back since, by Sender.identity.
    """

    sent_as: Mapping[int, int] = field(default_factory=dict)
    sent_seqs: Mapping[str, SentSeqs] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PendingMission:
    """A mission that the flight controller may or may not have.

    `number`: in the store, None if not stored. `identity`: of the list to look for, None if it was rejected.
    `before`: of the previous list, None if unknown.
    """

    number: int | None
    identity: ListIdentity | None
    before: ListIdentity | None = None
