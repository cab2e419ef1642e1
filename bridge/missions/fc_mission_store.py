# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between missions and the flight controllers that store them, each kind in its own way."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic

from bridge.line.conversation import Conversation
from bridge.missions.list_check import MissionRules
from bridge.model.ground_track import Place
from bridge.model.missions import Refusal
from bridge.voice import sentences
from protocols.mission_item import ListIdentity, MissionItem
from reports.verdict import RecordT


class StoreState(Enum):
    """The flight controller's readiness for a list."""

    READY = "ready"
    ARMED = "armed"
    BUSY = "busy"  # a configuration write is scheduled or running


class Loading(Enum):
    """The saved mission of a flight controller that may have none loaded."""

    NOT_NEEDED = "not needed"
    LOADED = "loaded"
    ARMED = "armed"  # not loaded: it is armed
    NO_ANSWER = "no answer"


@dataclass(frozen=True, slots=True)
class StoreReport:
    """The flight controller's report on the mission store. `stored` None if not known without reading the list."""

    state: StoreState
    rules: MissionRules
    stored: ListIdentity | None


class PushFailure(Enum):
    """The reason that a write failed. The flight controller's old list is intact except for LIST_IS_GONE."""

    ARMED = sentences.ARMED_BEFORE()
    BUSY = sentences.BUSY_BEFORE()
    WRITES_SPENT = sentences.WRITES_SPENT()
    NO_SPACE = sentences.NO_SPACE()
    REFUSED = sentences.RECORD_REFUSED()
    UNSAFE = sentences.UNSAFE()
    FLASH = sentences.FLASH_FAILED()
    NO_ANSWER = sentences.WRITE_UNANSWERED()
    OUT_OF_TIME = sentences.OUT_OF_TIME()
    STOPPED = sentences.STOPPED_WHILE_WRITING()
    UNCERTAIN = sentences.UNCERTAIN()
    INCOMPLETE = sentences.INCOMPLETE()
    ARMED_WHILE_WRITING = sentences.ARMED_WHILE_WRITING()
    PLACES_KEPT = sentences.PLACES_KEPT()
    PLACES_PARTLY = sentences.PLACES_PARTLY()
    PLACES_NOT_SAVED = sentences.PLACES_NOT_SAVED()
    NOT_SAVED = sentences.NOT_SAVED()


#: After these failures the old list is lost, or may be.
LIST_IS_GONE = frozenset(
    (PushFailure.UNCERTAIN, PushFailure.INCOMPLETE, PushFailure.ARMED_WHILE_WRITING, PushFailure.NOT_SAVED)
)


class PushFailed(Exception):
    """An attempt to write has failed. `is_final`: a retry would not help."""

    def __init__(self, failure: PushFailure, *, is_final: bool = True) -> None:
        super().__init__(failure.value.text)
        self.failure = failure
        self.is_final = is_final


@dataclass(frozen=True, slots=True)
class PushResult:
    """`failure` is None if the list was verified. `unchanged`: the same list was already there."""

    failure: PushFailure | None
    unchanged: bool = False


#: Called with the number of records written so far.
PushProgress = Callable[[int], None]


class FcMissionStore(ABC, Generic[RecordT]):
    """A flight controller that stores missions. By default only one, which only the bridge changes."""

    #: True if the list can be read while the craft is armed.
    reads_armed: bool = False
    #: How often to ask `is_current`, s.
    watch_s: float = 1.0
    #: Further missions on the board, as last read. Only one mission at a time is loaded and flown.
    others: tuple[tuple[RecordT, ...], ...] = ()

    @abstractmethod
    def report(self) -> Conversation[StoreReport | None]:
        """Ask the flight controller. Returns None if it does not answer."""

    @abstractmethod
    def push(self, records: tuple[RecordT, ...], progress: PushProgress) -> Conversation[PushResult]:
        """Write the list and verify it. The empty list clears."""

    @abstractmethod
    def pull(self) -> Conversation[tuple[RecordT, ...] | None]:
        """Read the list and verify the reading. Returns None if that fails."""

    @abstractmethod
    def items(self, records: Sequence[RecordT], sent_as: Mapping[int, int]) -> tuple[MissionItem, ...]:
        """A list as a ground station reads it, home first. `sent_as`: remembered commands, by record number."""

    @abstractmethod
    def seq_of(self, records: Sequence[RecordT], number: int) -> int:
        """The seq of the item for record `number` (as NAV_STATUS counts, from 1), or 0 if there is none."""

    def refreshed(self, items: tuple[MissionItem, ...]) -> tuple[MissionItem, ...]:
        """Items read earlier, brought up to date: home may move on boards that do not store it in the list."""
        return items

    def is_current(self) -> Conversation[bool]:
        """True if it still holds the list that was last read or written, or does not answer."""
        yield from ()
        return True

    def why_stopped(self, place: Place) -> str:
        """What may have stopped a mission at this place, or empty if unknown."""
        return ""

    def settings_changed(self) -> None:
        """The board's own settings, on which the rules may depend, may have changed."""

    def load(self) -> Conversation[Loading]:
        """Make it load its saved mission if it holds none."""
        yield from ()
        return Loading.NOT_NEEDED


class FliesToItems(ABC):
    """A mission store whose board can be sent to another item in flight."""

    @abstractmethod
    def leg_of(self, records: Sequence[Any], seq: int) -> int:
        """The number of the record that flies to item `seq`, as read back, or 0 if none does."""

    @abstractmethod
    def fly_to(self, records: Sequence[Any], number: int) -> Conversation[Refusal | None]:
        """Make it fly to this record of the mission. Returns None if it does."""


#: The mission store of any flight controller.
AnyFcMissionStore = FcMissionStore[Any]
