# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests of other programs to an INAV: long replies, and requests that only read."""

import pytest

from protocols.msp.frame import MAX_REPLY, Direction, MspFrame
from protocols.msp.nav import LAST, NavAction, NavRecord
from simulator.commands.fc_kinds import make_board
from tests.support.fake_inav import FakeInav
from tests.support.world import World

BOXNAMES, DATAFLASH_READ, SERVO_MIXER, SAFEHOME, SET_SAFEHOME = 116, 71, 0x2020, 0x2038, 0x2039
PAYLOADS = {DATAFLASH_READ: bytes(6)}
SETTING_INFO, SET_PID, SET_WP = 0x1007, 202, 209
NAME, SET_NAME, PID, SET_BOX, BOX, WP = 10, 11, 112, 203, 113, 118


@pytest.mark.parametrize(("command", "size"), [(BOXNAMES, 700), (SERVO_MIXER, 700), (DATAFLASH_READ, MAX_REPLY)])
def test_a_long_reply_is_forwarded_and_the_link_continues(command: int, size: int) -> None:
    board = FakeInav()
    board.answers = {**board.answers, command: bytes(size)}
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    found: list[MspFrame] = []
    for _ in range(3):
        frame = MspFrame(Direction.REQUEST, command, PAYLOADS.get(command, b""), is_v2=True)
        assert world.bridge.sharing.request(frame, found.append, world.now, may_write=False) == ""
        world.receive_from_fc(b"")  # sends it
        world.run(1.0)
    assert [frame.payload for frame in found] == [bytes(size)] * 3
    assert world.events("fc.lost") == []


@pytest.mark.parametrize(("command", "is_refused"), [(SAFEHOME, False), (SET_SAFEHOME, True)])
def test_a_request_with_a_payload_may_only_read(command: int, is_refused: bool) -> None:
    world = World(speeds=(115200,), peer=FakeInav())
    world.wait_ready(5)
    frame = MspFrame(Direction.REQUEST, command, b"\0")
    assert bool(world.bridge.sharing.request(frame, lambda _: None, world.now, may_write=False)) == is_refused


@pytest.mark.parametrize("is_damaged", [False, True])
@pytest.mark.parametrize("command", [BOXNAMES, DATAFLASH_READ])
def test_a_lost_reply_does_not_lose_the_link(command: int, is_damaged: bool) -> None:
    board = FakeInav(drop=lambda frame: "reply" if frame.command == command else "")
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    for _ in range(5):
        request = MspFrame(Direction.REQUEST, command, PAYLOADS.get(command, b""))
        assert world.bridge.sharing.request(request, lambda _: None, world.now, may_write=False) == ""
        world.receive_from_fc(b"")  # sends it
        if is_damaged:
            world.run(0.1)
            world.receive_from_fc(MspFrame(Direction.REPLY, command, bytes(MAX_REPLY)).encode()[:-1] + b"\xff")
        world.run(1.0)
    assert world.events("fc.lost") == []


def test_a_reply_with_the_text_of_its_request_is_not_an_echo() -> None:
    """SETTING_INFO's reply ends in the name that was asked for, and the port may read it in two parts."""
    board = FakeInav(drop=lambda frame: "request" if frame.command == SETTING_INFO else "")
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    found: list[MspFrame] = []
    name = b"nav_wp_multi_mission_index\0"
    world.bridge.sharing.request(
        MspFrame(Direction.REQUEST, SETTING_INFO, name, is_v2=True), found.append, world.now, may_write=False
    )
    world.receive_from_fc(b"")  # sends it
    world.run(0.02)
    reply = MspFrame(Direction.REPLY, SETTING_INFO, bytes(12) + name).encode()
    world.receive_from_fc(reply[:-6])
    world.receive_from_fc(reply[-6:])
    assert [frame.payload for frame in found] == [bytes(12) + name]
    assert world.is_found


def test_a_waiting_request_is_refused_once_the_craft_is_armed() -> None:
    board = FakeInav(drop=lambda frame: "request" if frame.command == SERVO_MIXER else "")
    world = World(speeds=(115200,), peer=board)
    world.wait_ready(5)
    found: list[MspFrame] = []
    for frame in (*[MspFrame(Direction.REQUEST, SERVO_MIXER)] * 10, MspFrame(Direction.REQUEST, SET_PID, b"\1")):
        assert world.bridge.sharing.request(frame, found.append, world.now, may_write=True) == ""
    board.armed = True
    world.run(10)
    assert SET_PID not in board.commands
    assert found[-1] == MspFrame(Direction.ERROR, SET_PID)


def test_a_record_that_crashes_an_inav_is_refused() -> None:
    world = World(speeds=(115200,), peer=make_board("inav"))
    world.wait_ready(20)
    refusals = []
    for number, record in enumerate((NavRecord(NavAction.WAYPOINT, 1, 1), NavRecord(NavAction.JUMP, flag=LAST)), 1):
        frame = MspFrame(Direction.REQUEST, SET_WP, bytes((number,)) + record.pack())
        refusals.append(world.bridge.sharing.request(frame, lambda _: None, world.now, may_write=True))
        world.run(1)
    assert refusals == ["", "record 2 jumps to 0, which is never forwarded"]
    assert world.naze.counters.crashes == 0


@pytest.mark.parametrize(
    ("kind", "poison", "setters", "settings"),
    [("multiwii", b"\xff" * 58, (SET_PID, SET_BOX), (PID, BOX)), ("inav", b"\0", (SET_NAME,), (NAME,))],
)
def test_an_empty_setter_is_no_read(
    kind: str, poison: bytes, setters: tuple[int, ...], settings: tuple[int, ...]
) -> None:
    """MultiWii executes it with what the request before it left in the receive buffer; INAV erases its name."""
    world = World(speeds=(115200,), peer=make_board(kind))
    world.wait_ready(20)
    before = [asked(world, command) for command in settings]
    assert all(before)
    for setter in setters:
        asked(world, WP, poison)
        asked(world, setter)
    assert [asked(world, command) for command in settings] == before
    assert not world.naze.armed


def test_a_waypoint_that_a_multiwii_would_keep_in_ram_is_no_read() -> None:
    """The one read last decides whether a return home lands (Protocol.cpp, recallWP)."""
    world = World(speeds=(115200,), peer=make_board("multiwii"))
    world.wait_ready(20)
    assert asked(world, WP, b"\1") is None
    assert asked(world, WP, b"\0") is not None


def asked(world: World, command: int, payload: bytes = b"") -> bytes | None:
    """The payload of the reply to a request of a client that may only read; None if it is refused."""
    found: list[MspFrame] = []
    world.bridge.sharing.request(
        MspFrame(Direction.REQUEST, command, payload), found.append, world.now, may_write=False
    )
    world.receive_from_fc(b"")  # sends it
    world.run(0.5)
    return found[0].payload if found else None
