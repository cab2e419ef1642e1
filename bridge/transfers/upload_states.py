# SPDX-License-Identifier: GPL-3.0-or-later
"""Uploads: their states from MISSION_COUNT to the final MISSION_ACK, and the events."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from math import inf

from bridge.gcs.ground_station import Sender
from bridge.missions.list_check import ListCheck
from bridge.missions.mission_service import OCCUPIED
from bridge.model.missions import Refusal
from bridge.transfers.arriving_list import ArrivingList, WholeList
from bridge.voice import sentences
from protocols.mission_item import MissionItem, MissionResult

#: QGroundControl reports a failed write 1.5 s after the last item, unless that is requested again; MAVSDK after 2.5 s.
#: Writing 120 records to an INAV takes 2.4 s. Twice in that time, in case one request is lost.
_NO_ANSWER_S = 0.6


class Event:
    """An event that changes an upload's state."""


class Turn(Event):
    """No other transfer delays this one."""


@dataclass(frozen=True, slots=True)
class Ready(Event):
    """The flight controller can take the list."""

    check: ListCheck


class SenderFinished(Event):
    """The ground station considers the list written: "Write Fast" ends so even if items were lost."""


@dataclass(frozen=True, slots=True)
class Arrived(Event):
    """The whole list has arrived, or enough of it to reject it."""

    whole: WholeList


class Delivered(Event):
    """The write has ended, with the verified result."""


class Cancelled(Event):
    """A MISSION_COUNT of 0: Mission Planner's Cancel button."""


@dataclass(frozen=True, slots=True)
class Replaced(Event):
    """Its station has begun another transfer, to which it would attribute this one's answer: so it gets none."""

    why: str


@dataclass(frozen=True, slots=True)
class Ended(Event):
    """Refused, cancelled or timed out."""

    refusal: Refusal


class UploadState:
    """A state ends at `deadline`, `seconds` after the start or last progress. `timeout` is then the answer."""

    seconds: float
    timeout: Refusal

    def __init__(self, _upload: "Upload", _event: Event, now: float) -> None:
        self._began_at = now

    @property
    def deadline(self) -> float:
        return self._began_at + self.seconds

    @property
    def received(self) -> tuple[MissionItem, ...]:
        """The items so far, in the order of their numbers."""
        return ()

    @property
    def due(self) -> float:
        """The time to repeat a request, or to give up."""
        return self.deadline

    def repeats(self, _now: float) -> tuple[int, ...]:
        """The items to request again at `due`."""
        return ()

    def item_repeated(self, now: float) -> None:
        """The station repeats an item of a list that has arrived."""


class Waiting(UploadState):
    """Another transfer runs. Mission Planner repeats MISSION_COUNT for 2.8 s."""

    seconds = 2.5
    timeout = OCCUPIED


class Asking(UploadState):
    """The flight controller has been asked if it can take a list."""

    seconds = 5.0
    timeout = Refusal(MissionResult.DENIED, sentences.NO_ANSWER())


class Receiving(UploadState):
    """Items arrive."""

    seconds = 5.0
    timeout = Refusal(MissionResult.OPERATION_CANCELLED, sentences.UPLOAD_SILENT(seconds))

    def __init__(self, upload: "Upload", event: Ready, now: float) -> None:
        super().__init__(upload, event, now)
        self.list = ArrivingList(upload.count, event.check, now)
        self.list.request.asked(0, now)

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return self.list.received

    @property
    def deadline(self) -> float:
        return max(self._began_at, self.list.progress_at) + self.seconds

    @property
    def due(self) -> float:
        return min(self.deadline, self.list.request.due)

    def repeats(self, now: float) -> tuple[int, ...]:
        return (self.list.ask_again(now),)


class Closing(Receiving):
    """Mission Planner's "Write Fast" has ended. Delayed items may still arrive."""

    seconds = 0.3

    def __init__(self, upload: "Upload", event: SenderFinished, now: float) -> None:
        UploadState.__init__(self, upload, event, now)
        assert isinstance(upload.state, Receiving)
        self.list, missing = upload.state.list, upload.state.list.missing
        why = sentences.ITEMS_MISSING(missing, upload.count) if missing else sentences.MESSAGES_LOST()
        self.timeout = Refusal(MissionResult.OPERATION_CANCELLED, why)


class _Whole(UploadState):
    """The whole list is here. The last two items are requested again while the station waits for the final ack."""

    is_awaited = True

    def __init__(self, upload: "Upload", event: Event, now: float) -> None:
        super().__init__(upload, event, now)
        self._count = upload.count if self.is_awaited else 0
        self._reminder_at = now + _NO_ANSWER_S if self._count else inf

    @property
    def due(self) -> float:
        return min(self.deadline, self._reminder_at)

    def item_repeated(self, now: float) -> None:
        self._reminder_at = now + _NO_ANSWER_S if self._count else inf

    def repeats(self, now: float) -> tuple[int, ...]:
        self.item_repeated(now)
        # MAVSDK allows five repeats. Only a request for the item after the one before resets its count.
        return tuple(range(max(self._count - 2, 0), self._count))


class Complete(_Whole):
    """The list has arrived, or it is a clear, and another is being written."""

    seconds = 2.5
    timeout = OCCUPIED

    def __init__(self, upload: "Upload", event: Arrived, now: float) -> None:
        super().__init__(upload, event, now)
        self.whole = event.whole

    @property
    def received(self) -> tuple[MissionItem, ...]:
        return self.whole.items


class Delivering(_Whole):
    """The list is stored, written and read back: 146 records take 25 s at 1200 baud."""

    seconds = 60.0
    timeout = Refusal(MissionResult.DENIED, sentences.STILL_WRITING())


class DeliveringDespiteCancel(Delivering):
    """The Cancel came too late. Its repeats, for up to 3 s after the end, must not clear the mission."""


class DeliveringUnanswered(Delivering):
    """The station has begun another transfer meanwhile, to which it would attribute this one's ack."""

    is_awaited = False


@dataclass(eq=False)
class Upload:
    """One ground station's upload of `count` items. A clear has 0.

    `mission_type`: MAV_MISSION_TYPE of the final MISSION_ACK. `heard_at`: when its ground station last sent a message
    of it. `number`: of the frame that began it.
    """

    sender: Sender
    count: int
    mission_type: int
    heard_at: float
    number: int = 0
    #: The sender has ended it itself, with a MISSION_ACK: only Mission Planner's "Write Fast" does, and sends home.
    is_write_fast: bool = False
    #: The list is the board's own without some items.
    is_part: bool = False
    has_losses: bool = False  # an item was requested again

    def __post_init__(self) -> None:
        self.state: UploadState = Waiting(self, Event(), self.heard_at)


class Fixed(Enum):
    """An entry of the table that is not a state."""

    #: The event cannot happen in this state: a bug.
    NEVER = auto()
    #: The event does not change anything.
    STAYS = auto()
    END = auto()


_Row = tuple[type[UploadState] | Fixed, ...]
_NEVER, _STAYS, _END = Fixed.NEVER, Fixed.STAYS, Fixed.END
_EVENTS = Turn, Ready, Arrived, SenderFinished, Delivered, Ended, Cancelled, Replaced
_WRITING = _NEVER, _NEVER, _NEVER, _NEVER, _END, _END
# fmt: off
_ROWS: Mapping[type[UploadState], _Row] = {
    #           Turn        Ready      Arrived   SenderFinished Delivered Ended Cancelled Replaced
    Waiting:   (Asking,     _NEVER,    Complete, _NEVER,        _NEVER,   _END, _END,     _END),
    Asking:    (_NEVER,     Receiving, _NEVER,   _NEVER,        _NEVER,   _END, _END,     _END),
    Receiving: (_NEVER,     _NEVER,    Complete, Closing,       _NEVER,   _END, _END,     _END),
    Closing:   (_NEVER,     _NEVER,    Complete, _STAYS,        _NEVER,   _END, _END,     _END),
    Complete:  (Delivering, _NEVER,    _NEVER,   _STAYS,        _NEVER,   _END, _END,     _END),
    #                                    Cancelled                Replaced
    Delivering:              (*_WRITING, DeliveringDespiteCancel, DeliveringUnanswered),
    DeliveringDespiteCancel: (*_WRITING, _STAYS,                  DeliveringUnanswered),
    DeliveringUnanswered:    (*_WRITING, _STAYS,                  _STAYS),
}
# fmt: on
#: State -> event -> next state. A clear does not ask for items: it waits, and is complete.
TRANSITIONS = {state: dict(zip(_EVENTS, row, strict=True)) for state, row in _ROWS.items()}
