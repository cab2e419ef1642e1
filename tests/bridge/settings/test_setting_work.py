# SPDX-License-Identifier: GPL-3.0-or-later
"""One item of work on the settings: written only on a disarmed board, and answered once."""

from collections.abc import Sequence

import pytest

from bridge.fc.fc_settings import ARMED, NO_ANSWER, NOT_TAKEN, FcSettings, SettingRefusal, TableReading
from bridge.line.conversation import Conversation, Pause, Receive
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind
from bridge.settings.setting_work import TRANSITIONS, Answer, SettingChange, SettingsSave, WorkEvent, WorkState
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame

ARM_BIT = 5
SETTING = BoardSetting("p_roll", ValueKind.INTEGER, 1, 200, 35)


class ObedientSettings(FcSettings):
    """Takes a second for each step. `refused`: its answer to a write."""

    def __init__(self, refused: SettingRefusal | None = None) -> None:
        self.refused = refused

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        raise AssertionError("not asked")

    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        yield Pause(1.0)
        return self.refused

    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        yield Pause(2.0)
        return (setting,)

    def save(self) -> Conversation[SettingRefusal | None]:
        yield Pause(3.0)
        return self.refused


def status(flags: int) -> MspFrame:
    return MspFrame(Direction.REPLY, Msp.STATUS, bytes(6) + flags.to_bytes(4, "little") + b"\0")


def change() -> SettingChange:
    work = SettingChange("test", lambda _answer, _at: None, name="p_roll", value=36.0, before=SETTING)
    work.advance(WorkEvent.TURN)
    return work


def outcome(conversation: Conversation[Answer], *answers: object) -> Answer:
    next(conversation)
    for answer in answers[:-1]:
        conversation.send(answer)
    with pytest.raises(StopIteration) as end:
        conversation.send(answers[-1])
    result: Answer = end.value.value
    return result


def test_a_change_is_checked_written_and_read_back() -> None:
    work, states = change(), list[WorkState]()
    conversation = work.carry_out(ObedientSettings(), ARM_BIT)
    assert isinstance(next(conversation), Receive)
    states.append(work.state)
    for answer, pause_s in ((status(0b1011111), 1.0), (None, 2.0)):
        assert conversation.send(answer) == Pause(pause_s)
        states.append(work.state)
    assert states == [WorkState.CHECKING, WorkState.WRITING, WorkState.READING_BACK]
    with pytest.raises(StopIteration) as end:
        conversation.send(None)
    assert end.value.value == (SETTING,)


def test_a_save_ends_without_settings() -> None:
    work = SettingsSave("test", lambda _answer, _at: None, WorkState.CHECKING)
    assert outcome(work.carry_out(ObedientSettings(), ARM_BIT), status(0), None) == ()


@pytest.mark.parametrize(
    ("arm_bit", "reply", "refused"), [(ARM_BIT, status(1 << ARM_BIT), ARMED), (None, status(0), NO_ANSWER)]
)
def test_a_board_that_is_armed_or_lacks_an_arm_flag_is_not_written(
    arm_bit: int | None, reply: MspFrame, refused: SettingRefusal
) -> None:
    work = change()
    assert outcome(work.carry_out(ObedientSettings(), arm_bit), reply) is refused
    assert not work.may_have_acted


def test_a_board_that_does_not_answer_is_not_written() -> None:
    work = change()
    assert outcome(work.carry_out(ObedientSettings(), ARM_BIT), None, None, None) is NO_ANSWER
    assert not work.may_have_acted


def test_a_refused_write_is_not_read_back() -> None:
    work = change()
    assert outcome(work.carry_out(ObedientSettings(NOT_TAKEN), ARM_BIT), status(0), None) is NOT_TAKEN
    assert work.may_have_acted


def test_every_state_ends_in_one_answer() -> None:
    for state, row in TRANSITIONS.items():
        assert state is WorkState.ANSWERED or row[WorkEvent.END] is WorkState.ANSWERED
    work = change()
    work.end(NO_ANSWER, 0.0)
    with pytest.raises(KeyError):
        work.end(NO_ANSWER, 0.0)
