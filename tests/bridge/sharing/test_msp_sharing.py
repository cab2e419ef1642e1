# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests of other programs: forwarded to an INAV, with long replies, losses and changes."""

import itertools
import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.nav import LAST, NavAction, NavRecord
from simulator.commands.fc_kinds import make_board
from tests.support.fake_inav import FakeInav
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, World, ready_world

DATAFLASH_READ, BOXNAMES, WP, SERVO_MIXER = 71, 116, 118, 0x2020
#: A block of the data flash, the largest reply of an INAV.
LARGEST_REPLY = 4112
SAFEHOME, SET_SAFEHOME, SETTING_INFO = 0x2038, 0x2039, 0x1007
SET_PID, SET_WP, SET_MOTOR, EEPROM_WRITE = 202, 209, 214, 250
PAYLOADS = {DATAFLASH_READ: bytes(6)}
NAME, SET_NAME, PID, SET_BOX, BOX = 10, 11, 112, 203, 113


def ready(board: FakeInav, *, may_write: bool = False) -> tuple[World, ShareProgram]:
    world = ready_world(peer=board, within_s=5)
    return world, ShareProgram(world, may_write=may_write)


@pytest.mark.parametrize(("command", "size"), [(BOXNAMES, 700), (SERVO_MIXER, 500), (DATAFLASH_READ, LARGEST_REPLY)])
def test_a_long_reply_is_forwarded_and_the_link_continues(command: int, size: int) -> None:
    board = FakeInav()
    board.answers = {**board.answers, command: bytes(size)}
    world, program = ready(board)
    for _ in range(3):
        reply = program.wait_for(command, PAYLOADS.get(command, b""), is_v2=True)
        assert (reply.payload, reply.is_v2) == (bytes(size), True)
        world.run(1)
    assert world.events("fc.lost") == []


@pytest.mark.parametrize("is_damaged", [False, True])
@pytest.mark.parametrize("command", [BOXNAMES, DATAFLASH_READ])
def test_a_lost_reply_does_not_lose_the_link(command: int, is_damaged: bool) -> None:
    world, program = ready(FakeInav(drop=lambda frame: "reply" if frame.command == command else ""))
    program.ask(command, PAYLOADS.get(command, b""))
    for _ in range(4):
        if is_damaged:
            world.run(0.1)
            world.receive_from_fc(MspFrame(Direction.REPLY, command, bytes(LARGEST_REPLY)).encode()[:-1] + b"\xff")
        world.run(0.9)
    assert world.events("fc.lost") == []
    assert program.closed_at is not None
    (event,) = world.events("share.refused")
    assert event.facts["why"] == "no reply from the flight controller"


def test_a_lost_request_is_repeated() -> None:
    losses = itertools.count()
    board = FakeInav(drop=lambda frame: "request" if frame.command == SAFEHOME and next(losses) < 2 else "")
    board.answers = {**board.answers, SAFEHOME: b"\0home"}
    _, program = ready(board)
    assert program.wait_for(SAFEHOME, b"\0").payload == b"\0home"


def test_a_reply_with_the_text_of_the_request_is_not_an_echo() -> None:
    """SETTING_INFO's reply ends in the name that was asked for, and the port may read it in two parts."""
    board = FakeInav(drop=lambda frame: "request" if frame.command == SETTING_INFO else "")
    world, program = ready(board)
    world.run(5)  # the bridge has asked for settings itself, and given up
    name = b"nav_wp_multi_mission_index\0"
    program.ask(SETTING_INFO, name, is_v2=True, wait_s=0.02)
    reply = MspFrame(Direction.REPLY, SETTING_INFO, bytes(12) + name).encode()
    world.receive_from_fc(reply[:-6])
    world.receive_from_fc(reply[-6:])
    assert [frame.payload for _, frame in program.replies] == [bytes(12) + name]
    assert world.is_found


def test_a_reply_belongs_to_the_index_that_was_asked_for() -> None:
    """The bridge polls WP 0, the programs read other numbers, and every twelfth reply is lost."""
    chance = random.Random(7)
    board = FakeInav()
    positions = [NavRecord(NavAction.WAYPOINT, number, number).pack() for number in range(1, 100)]
    board.records, board.is_valid = [*positions[:-1], positions[-1][:-1] + bytes((LAST,))], True
    world, program = ready(board)
    board.drop = lambda frame: "reply" if frame.command == WP and chance.random() < 0.08 else ""
    home = ShareProgram(world, "192.0.2.8:1")
    home.ask_every(0.3, (WP, b"\0"))
    for number in range(1, 100):
        assert program.wait_for(WP, bytes((number,))).payload[:3] == bytes((number, NavAction.WAYPOINT, number))
    assert {frame.payload[0] for _, frame in home.replies} == {0}


@pytest.mark.parametrize(
    ("may_write", "request_", "reason"),
    [
        (False, (SET_SAFEHOME, bytes(10)), "read-only"),
        (False, (EEPROM_WRITE, b""), "read-only"),
        (True, (SET_MOTOR, bytes(16)), "never forwarded"),
        (True, (SET_WP, b"\2" + NavRecord(NavAction.JUMP, flag=LAST).pack()), "crashes INAV"),
        (True, (0x3999, b"\0"), "unknown"),
    ],
)
def test_a_refused_change_disconnects_and_is_reported(
    may_write: bool, request_: tuple[int, bytes], reason: str
) -> None:
    board = FakeInav()
    world, program = ready(board, may_write=may_write)
    station = GroundStation(world)
    station.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3), wait_s=1)
    program.ask(*request_, wait_s=1)
    assert program.closed_at is not None
    assert program.replies == []
    assert request_[0] not in board.commands
    (event,) = world.events("share.refused")
    assert (event.level, event.facts["program"]) == ("warning", "192.0.2.7:5000")
    assert reason in str(event.facts["why"])
    text = " ".join(text for text in station.texts() if "192.0.2.7" in text)
    assert str(event.facts["command"]) in text


@pytest.mark.parametrize(
    ("addresses", "interval_s", "most"),
    [
        ([f"192.0.2.7:{port}" for port in range(20)], 0.5, 1),
        # Forged.
        ([f"198.51.100.{host}:1" for host in range(200)], 0.05, 10),
    ],
    ids=["one program", "many hosts"],
)
def test_repeated_refusals_do_not_flood_the_stations_with_texts(
    addresses: list[str], interval_s: float, most: int
) -> None:
    world, _ = ready(FakeInav())
    station = GroundStation(world)
    station.send(station.heartbeat, wait_s=1)
    for address in addresses:
        ShareProgram(world, address).ask(SET_PID, bytes(30), wait_s=interval_s)
    assert 1 <= sum("refused" in text for text in station.texts()) <= most
    assert len(world.events("share.refused")) == sum(world.inside.sharing.refused.values()) == len(addresses)


def test_an_unknown_read_gets_the_reply_that_the_board_would_send() -> None:
    """mwp asks every board for INAV's commands, and goes on after the error."""
    world = ready_world()
    program = ShareProgram(world)
    for command, payload in ((SERVO_MIXER, b""), (SAFEHOME, b"\0"), (0x3999, b"")):
        assert program.wait_for(command, payload, is_v2=True) == MspFrame(Direction.ERROR, command)
    assert program.closed_at is None


@pytest.mark.parametrize("command", [247, 0x1002])  # SET_RTC, COMMON_SET_TZ
def test_mwp_connects_although_the_clock_is_not_set(command: int) -> None:
    board = FakeInav()
    world, program = ready(board)
    assert program.wait_for(command, bytes(2), is_v2=True).direction is Direction.ERROR
    assert program.closed_at is None
    assert command not in board.commands
    assert world.inside.sharing.refused == {}


def test_a_change_is_forwarded_after_checking_the_arm_flag() -> None:
    board = FakeInav()
    board.answers = {**board.answers, SET_SAFEHOME: b""}
    world, program = ready(board, may_write=True)
    assert program.wait_for(SET_SAFEHOME, bytes(10)).direction is Direction.REPLY
    at = board.commands.index(SET_SAFEHOME)
    assert board.commands[at - 1] == 101  # STATUS
    board.armed = True  # and no poll has reported it yet
    program.ask(SET_SAFEHOME, bytes(10), wait_s=1)
    assert board.commands.count(SET_SAFEHOME) == 1
    assert program.closed_at is not None
    assert [event.facts["why"] for event in world.events("share.refused")] == ["armed"]


def test_a_read_after_a_change_gets_the_new_value() -> None:
    board = FakeInav()
    board.answers = {**board.answers, SAFEHOME: b"\0old", SET_SAFEHOME: b""}
    _, program = ready(board, may_write=True)
    assert program.wait_for(SAFEHOME, b"\0").payload == b"\0old"
    program.ask(SET_SAFEHOME, bytes(10))
    board.answers = {**board.answers, SAFEHOME: b"\0new"}
    program.ask(SAFEHOME, b"\0")
    program.world.wait_until(lambda _: len(program.replies) > 2, 4)
    assert [frame.payload for _, frame in program.replies] == [b"\0old", b"", b"\0new"]


def test_a_waiting_change_is_refused_once_the_craft_is_armed() -> None:
    board = FakeInav(drop=lambda frame: "request" if frame.command == SERVO_MIXER else "")
    world, program = ready(board, may_write=True)
    program.ask(SERVO_MIXER)
    program.ask(SET_PID, b"\1")
    board.armed = True
    world.run(10)
    assert SET_PID not in board.commands
    assert program.closed_at is not None


def test_a_record_that_does_not_crash_an_inav_is_written() -> None:
    program = ShareProgram(ready_world(peer=make_board("inav")), may_write=True)
    record = NavRecord(NavAction.WAYPOINT, 1, 1)
    assert program.wait_for(SET_WP, b"\1" + record.pack()).direction is Direction.REPLY


@pytest.mark.parametrize(
    ("kind", "poison", "setters", "settings"),
    [("multiwii", b"\xff" * 58, (SET_PID, SET_BOX), (PID, BOX)), ("inav", b"\0", (SET_NAME,), (NAME,))],
)
def test_an_empty_setter_is_not_a_read(
    kind: str, poison: bytes, setters: tuple[int, ...], settings: tuple[int, ...]
) -> None:
    """MultiWii executes it with what the request before it left in the receive buffer; INAV erases its name."""
    world = ready_world(peer=make_board(kind))
    before = [ShareProgram(world).wait_for(command) for command in settings]
    for setter in setters:
        for command, payload in ((WP, poison), (setter, b"")):
            ShareProgram(world).ask(command, payload, wait_s=1)
    after = [ShareProgram(world).wait_for(command) for command in settings]
    assert after == before
    assert {reply.direction for reply in after} == {Direction.REPLY}
    assert not world.naze.armed


def test_a_waypoint_that_a_multiwii_would_keep_in_ram_is_not_a_read() -> None:
    """The one read last decides whether a return home lands (Protocol.cpp, recallWP)."""
    world = ready_world(peer=make_board("multiwii"))
    world.written.clear()
    first, home = (ShareProgram(world).outcome(WP, bytes((number,))) for number in (1, 0))
    assert first is None or first.direction is Direction.ERROR
    assert home is not None
    assert home.direction is Direction.REPLY
    assert request(WP, b"\1") not in [data for _, _, data in world.written]
