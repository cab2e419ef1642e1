# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on the board's settings: the change of one, or the save of all, from the request to the answer.

Parameters, restores, the status page, zenoh and the command line all use it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from bridge.fc.fc_settings import ARMED, NO_ANSWER, FcSettings, SettingRefusal
from bridge.line.conversation import Conversation, ask_armed
from bridge.model.settings import BoardSetting, Value

#: The changed setting as read back, or no setting after a save.
Answer = Sequence[BoardSetting] | SettingRefusal
OnDone = Callable[[Answer, float], None]


class WorkState(Enum):
    """The states of an item of work."""

    #: It waits for its turn.
    ASKED = auto()
    #: The board is asked whether it is armed.
    CHECKING = auto()
    WRITING = auto()
    READING_BACK = auto()
    ANSWERED = auto()


class WorkEvent(Enum):
    """What changes the state."""

    TURN = auto()
    DISARMED = auto()
    WRITTEN = auto()
    #: Done, refused, or without an answer from the board.
    END = auto()


#: WorkState -> event -> next state. An event without an entry cannot happen: a bug.
TRANSITIONS: Mapping[WorkState, Mapping[WorkEvent, WorkState]] = {
    WorkState.ASKED: {WorkEvent.TURN: WorkState.CHECKING, WorkEvent.END: WorkState.ANSWERED},
    WorkState.CHECKING: {WorkEvent.DISARMED: WorkState.WRITING, WorkEvent.END: WorkState.ANSWERED},
    WorkState.WRITING: {WorkEvent.WRITTEN: WorkState.READING_BACK, WorkEvent.END: WorkState.ANSWERED},
    WorkState.READING_BACK: {WorkEvent.END: WorkState.ANSWERED},
    WorkState.ANSWERED: {},
}


@dataclass(eq=False)
class SettingWork(ABC):
    """One item. client: the name in the log."""

    client: str
    on_done: OnDone
    state: WorkState = WorkState.ASKED

    def advance(self, event: WorkEvent) -> None:
        self.state = TRANSITIONS[self.state][event]

    @property
    def may_have_acted(self) -> bool:
        """True if a write was sent to the board, which may have carried it out whatever it answered."""
        return self.state in (WorkState.WRITING, WorkState.READING_BACK)

    def end(self, answer: Answer, now: float) -> None:
        self.advance(WorkEvent.END)
        self.on_done(answer, now)

    def carry_out(self, fc_settings: FcSettings, arm_bit: int | None) -> Conversation[Answer]:
        """Write if STATUS says disarmed now: telemetry may not show it yet. Returns the settings read back.

        arm_bit: see FlightController.
        """
        armed = yield from ask_armed(arm_bit)
        if armed is not False:
            return ARMED if armed else NO_ANSWER
        self.advance(WorkEvent.DISARMED)
        return (yield from self._write(fc_settings))

    @abstractmethod
    def _write(self, fc_settings: FcSettings) -> Conversation[Answer]: ...


@dataclass(eq=False)
class SettingChange(SettingWork):
    """Give a setting another value in the board's RAM. before: the setting, known when the change is next."""

    name: str = ""
    value: Value = 0.0
    before: BoardSetting | None = None

    def _write(self, fc_settings: FcSettings) -> Conversation[Answer]:
        assert self.before is not None
        refused = yield from fc_settings.write(self.before, self.value)
        if refused is not None:
            return refused
        self.advance(WorkEvent.WRITTEN)
        return (yield from fc_settings.read_back(self.before)) or NO_ANSWER


class SettingsSave(SettingWork):
    """Write the settings in RAM to the board's flash. They are read again afterwards."""

    def _write(self, fc_settings: FcSettings) -> Conversation[Answer]:
        return (yield from fc_settings.save()) or ()
