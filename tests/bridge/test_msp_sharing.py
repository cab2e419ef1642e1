# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests of other programs to an INAV: long replies, and requests that only read."""

import pytest

from protocols.msp.frame import MAX_REPLY, Direction, MspFrame
from tests.support.fake_inav import FakeInav
from tests.support.world import World

BOXNAMES, DATAFLASH_READ, SERVO_MIXER, SAFEHOME, SET_SAFEHOME = 116, 71, 0x2020, 0x2038, 0x2039


@pytest.mark.parametrize(("command", "size"), [(BOXNAMES, 700), (SERVO_MIXER, 700), (DATAFLASH_READ, MAX_REPLY)])
def test_a_long_reply_is_forwarded_and_the_link_continues(command: int, size: int) -> None:
    board = FakeInav()
    board.answers = {**board.answers, command: bytes(size)}
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    found: list[MspFrame] = []
    for _ in range(3):
        frame = MspFrame(Direction.REQUEST, command, is_v2=True)
        assert world.bridge.sharing.request(frame, found.append, world.now, may_write=False) == ""
        world.hear(b"")  # sends it
        world.run(1.0)
    assert [frame.payload for frame in found] == [bytes(size)] * 3
    assert world.events("fc.lost") == []


@pytest.mark.parametrize(("command", "is_refused"), [(SAFEHOME, False), (SET_SAFEHOME, True)])
def test_a_request_with_a_payload_may_only_read(command: int, is_refused: bool) -> None:
    world = World(speeds=(115200,), peer=FakeInav())
    world.wait_ready(5)
    frame = MspFrame(Direction.REQUEST, command, b"\0")
    assert bool(world.bridge.sharing.request(frame, lambda _: None, world.now, may_write=False)) == is_refused
