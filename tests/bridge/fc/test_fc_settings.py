# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from bridge.fc.fc_settings import ARMED, NO_ANSWER, SettingRefusal, while_disarmed
from bridge.line.conversation import Conversation, Pause, Receive
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame

ARM_BIT = 5


def save() -> Conversation[SettingRefusal | None]:
    yield Pause(1.0)
    return None


def status(flags: int) -> MspFrame:
    return MspFrame(Direction.REPLY, Msp.STATUS, bytes(6) + flags.to_bytes(4, "little") + b"\0")


def test_it_is_held_if_the_board_says_that_it_is_disarmed() -> None:
    conversation = while_disarmed(ARM_BIT, save())
    assert isinstance(next(conversation), Receive)
    assert conversation.send(status(0b1011111)) == Pause(1.0)
    with pytest.raises(StopIteration) as end:
        conversation.send(None)
    assert end.value.value is None


@pytest.mark.parametrize(
    ("arm_bit", "reply", "refused"), [(ARM_BIT, status(1 << ARM_BIT), ARMED), (None, status(0), NO_ANSWER)]
)
def test_it_is_not_started_on_an_armed_board_or_one_without_an_arm_flag(
    arm_bit: int | None, reply: MspFrame, refused: SettingRefusal
) -> None:
    conversation = while_disarmed(arm_bit, save())
    next(conversation)
    with pytest.raises(StopIteration) as end:
        conversation.send(reply)
    assert end.value.value is refused


def test_without_an_answer_it_is_not_started() -> None:
    conversation = while_disarmed(ARM_BIT, save())
    asked = [next(conversation), conversation.send(None), conversation.send(None)]
    assert all(isinstance(effect, Receive) for effect in asked)
    with pytest.raises(StopIteration) as end:
        conversation.send(None)
    assert end.value.value is NO_ANSWER
