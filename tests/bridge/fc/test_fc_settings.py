# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from bridge.fc.fc_settings import NO_ANSWER, NOT_SAVED, SettingRefusal, write_eeprom
from bridge.line.conversation import Receive
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame

WRITTEN, REFUSED = (MspFrame(direction, 250, b"") for direction in (Direction.REPLY, Direction.ERROR))
STATUS = MspFrame(Direction.REPLY, Msp.STATUS, bytes(11))


@pytest.mark.parametrize(
    ("reply", "statuses", "result"),
    [(WRITTEN, [None, STATUS], None), (REFUSED, [STATUS], NOT_SAVED), (None, [STATUS], NO_ANSWER)],
)
def test_a_save_is_sent_once_and_ends_with_the_next_status(
    reply: MspFrame | None, statuses: list[MspFrame | None], result: SettingRefusal | None
) -> None:
    conversation = write_eeprom()
    asked = [next(conversation), conversation.send(reply)]
    asked += [conversation.send(status) for status in statuses[:-1]]
    with pytest.raises(StopIteration) as end:
        conversation.send(statuses[-1])
    assert end.value.value is result
    assert [each.commands for each in asked if isinstance(each, Receive)].count(frozenset({250})) == 1
