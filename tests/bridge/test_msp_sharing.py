# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests of other programs to an INAV: long replies, and which requests only read."""

import pytest

from protocols.msp.frame import MAX_REPLY, Direction, MspFrame
from tests.support.fake_inav import FakeInav
from tests.support.world import World

BOXNAMES, DATAFLASH_READ, SERVO_MIXER, SAFEHOME, SET_SAFEHOME = 116, 71, 0x2020, 0x2038, 0x2039


def replies(board: FakeInav, *commands: int) -> list[MspFrame]:
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    found: list[MspFrame] = []
    for command in commands:
        frame = MspFrame(Direction.REQUEST, command, is_v2=True)
        assert world.bridge.sharing.request(frame, found.append, world.now, may_write=False) == ""
        world.hear(b"")  # sends it
        world.run(1.0)
    world.run(5.0)
    assert world.events("fc.lost") == []
    return found


@pytest.mark.parametrize("command", [BOXNAMES, SERVO_MIXER, DATAFLASH_READ])
def test_a_long_reply_is_forwarded_and_the_link_goes_on(command: int) -> None:
    board = FakeInav()
    board.answers[command] = bytes(MAX_REPLY if command == DATAFLASH_READ else 700)
    found = replies(board, *[command] * 3)
    assert [frame.payload for frame in found] == [board.answers[command]] * 3


@pytest.mark.parametrize(("command", "is_refused"), [(SAFEHOME, False), (SET_SAFEHOME, True)])
def test_a_request_that_says_what_to_read_is_no_change(command: int, is_refused: bool) -> None:
    world = World(speeds=(115200,), peer=FakeInav())
    world.wait_ready(5)
    frame = MspFrame(Direction.REQUEST, command, b"\0")
    assert bool(world.bridge.sharing.request(frame, lambda _: None, world.now, may_write=False)) == is_refused
