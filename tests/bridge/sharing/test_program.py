# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs slow down neither ground stations, missions nor each other: floods, transfers, and repeated reads."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.msp.frame import Direction
from simulator.board.msp_options import MspOptions
from simulator.board.options import SimOptions
from simulator.commands.fc_kinds import make_board
from terminal.files import load_mission
from tests.support.fake_inav import FakeInav
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, World, ready_world

IDENT, RC_TUNING, PID, MISC, BOXNAMES, PIDNAMES, ATTITUDE, WP = 100, 111, 112, 114, 116, 117, 108, 118
API_VERSION, FC_VARIANT, FC_VERSION, BOARD_INFO, BUILD_INFO, UID, NAME, BOXIDS = 1, 2, 3, 4, 5, 160, 10, 119
INAV_MIXER = 0x2010
EXAMPLES = Path(__file__).parents[3] / "examples"
#: A different read each time: what one reply answers is no load.
FLOODS = {
    "harakiri": [(command, b"") for command in (PID, RC_TUNING, MISC, BOXNAMES, PIDNAMES)],
    "inav": [(WP, bytes((number,))) for number in range(1, 121)],
}


def flying_station(kind: str, baud: int = 115200) -> tuple[World, GroundStation]:
    peer = None if kind == "harakiri" else make_board(kind, MspOptions(baud=baud))
    world = World(SimOptions(baud=baud), speeds=(baud,), peer=peer)
    station = GroundStation(world).stay_connected()
    world.wait_ready(60, then_s=3)
    return world, station


def attitudes(world: World, station: GroundStation) -> int:
    station.take()
    world.run(10)
    return len(station.take("ATTITUDE"))


def push_s(world: World, kind: str) -> float:
    """The time that it takes to write six missions."""
    items = load_mission(EXAMPLES / ("long-146.waypoints" if kind == "harakiri" else "naze-field.waypoints"))
    elapsed = 0.0
    for count in range(6):
        began = world.now
        assert world.pushed(items[: len(items) - count], 60).ack == m.MAV_MISSION_ACCEPTED
        elapsed += world.now - began
        world.run(0.5)
    return elapsed


@pytest.mark.parametrize(("kind", "baud"), [("harakiri", 115200), ("inav", 19200)])
def test_a_flooder_harms_only_itself(kind: str, baud: int) -> None:
    world, station = flying_station(kind, baud)
    before, push_before_s = attitudes(world, station), push_s(world, kind)
    for host in (66, 67):
        ShareProgram(world, f"192.0.2.{host}:1").ask_every(0.005, *FLOODS[kind])
    honest = ShareProgram(world)
    honest.ask_every(0.2, (INAV_MIXER if kind == "inav" else PID, b""))
    world.run(1)
    assert attitudes(world, station) >= 0.8 * before
    assert push_s(world, kind) <= 1.1 * push_before_s + 0.1
    honest.replies.clear()
    world.run(12)
    assert 59 <= len(honest.replies) <= 61
    assert honest.closed_at is None
    assert world.events("fc.lost") == []
    if kind == "harakiri":
        world.assert_line_was_clean()


def test_a_flooder_leaves_another_program_of_the_host_the_share() -> None:
    world, _ = flying_station("harakiri")
    ShareProgram(world, "192.0.2.66:1").ask_every(0.0025, (IDENT, b""))
    honest = ShareProgram(world, "192.0.2.66:2")
    honest.ask_every(0.02, (IDENT, b""))
    world.run(2)
    honest.replies.clear()
    world.run(5)
    assert 249 <= len(honest.replies) <= 251


def test_reads_that_are_never_answered_do_not_slow_telemetry() -> None:
    board = FakeInav(drop=lambda frame: "reply" if frame.command in (PID, MISC) else "")
    board.answers = {**board.answers, ATTITUDE: bytes(6)}
    world = ready_world(peer=board, within_s=5)
    ShareProgram(world, "192.0.2.9:1").ask_every(0.1, (ATTITUDE, b""))
    world.run(3)
    board.commands.clear()
    world.run(10)
    before = board.commands.count(ATTITUDE)
    for host in range(4):
        ShareProgram(world, f"192.0.2.{host}:1").ask_every(0.005, (PID, b""), (MISC, b""))
    world.run(3)
    assert board.commands.count(PID) >= 1
    board.commands.clear()
    world.run(10)
    assert board.commands.count(ATTITUDE) >= 0.8 * before
    assert world.events("fc.lost") == []


def asked_in(seconds: float, world: World, *commands: int) -> int:
    """How often the board is asked for these in this time."""
    return sum(frame.command in commands for frame in world.requests_during(seconds))


def test_the_replies_of_polls_do_not_use_the_line() -> None:
    world, station = flying_station("harakiri")
    before = asked_in(10, world, ATTITUDE)
    program = ShareProgram(world)
    program.ask_every(0.02, (ATTITUDE, b""))
    assert asked_in(10, world, ATTITUDE) <= before * 1.05
    assert len(program.replies) >= 499
    assert attitudes(world, station) >= 96


def test_a_poll_that_only_a_program_wants_runs_while_it_asks() -> None:
    world = ready_world()
    program = ShareProgram(world)
    program.ask_every(0.1, (ATTITUDE, b""))
    world.run(2)
    assert asked_in(5, world, ATTITUDE) >= 45
    program.closed_at = world.now
    world.run(4)
    assert asked_in(5, world, ATTITUDE) <= 6


def test_constant_replies_are_asked_for_once() -> None:
    world, _ = flying_station("inav")
    program = ShareProgram(world)
    greeting = (API_VERSION, FC_VARIANT, FC_VERSION, BOARD_INFO, BUILD_INFO, UID, BOXNAMES, BOXIDS)
    first = [program.wait_for(command).payload for command in greeting]
    world.run(1)
    again = [program.wait_for(command, seconds=5).payload for command in greeting]
    world.run(1)
    began = world.now
    assert first == again == [program.wait_for(command).payload for command in greeting]
    # The link's own question is API_VERSION.
    assert not {frame.command for frame in world.requests(began)} & set(greeting) - {API_VERSION}


def test_programs_that_ask_for_the_same_cost_one_request() -> None:
    world, _ = flying_station("harakiri")
    programs = [ShareProgram(world, f"192.0.2.{host}:1") for host in range(5)]
    world.run(5)  # the bridge has read the settings itself
    for program in programs:
        program.ask(PID)
    assert asked_in(0.5, world, PID) == 1
    assert [len(program.replies) for program in programs] == [1] * 5


def greet(program: ShareProgram, commands: Sequence[int]) -> None:
    """Ask like INAV Configurator, which waits for each reply."""
    for command in commands:
        assert program.wait_for(command, is_v2=True).direction is Direction.REPLY


@pytest.mark.parametrize(("kind", "baud"), [("inav", 19200), ("harakiri", 19200)])
def test_requests_during_a_transfer_wait_for_the_end(kind: str, baud: int) -> None:
    world, _ = flying_station(kind, baud)
    polled = (ATTITUDE, IDENT, BOXNAMES) if kind == "harakiri" else (ATTITUDE, FC_VARIANT, BOXIDS)
    others = (PID, MISC) if kind == "harakiri" else (API_VERSION, BUILD_INFO, NAME, BOARD_INFO, UID)
    items = load_mission(EXAMPLES / "naze-field.waypoints")
    for _ in range(3):
        outcome = world.push(items)
        world.run(0.05)
        program = ShareProgram(world)
        greet(program, polled)
        assert world.inside.runner.needs_line  # it still runs
        assert outcome == []
        greet(program, others)
        assert outcome != []
        assert program.closed_at is None
        world.run(2)


def test_a_program_that_waits_too_long_is_disconnected() -> None:
    world, _ = flying_station("harakiri", 2400)
    items = load_mission(EXAMPLES / "long-146.waypoints")
    outcome = world.push(items)
    world.run(1)
    program, other = ShareProgram(world), ShareProgram(world, "192.0.2.9:1")
    asked_at = world.now
    program.ask(PID)
    other.ask(PID, wait_s=4)
    assert outcome == []
    assert program.closed_at == pytest.approx(asked_at + 3, abs=0.3)
    assert program.replies == other.replies == []
    assert {event.facts["why"] for event in world.events("share.refused")} == {"a mission transfer is running"}


def test_without_a_flight_controller_requests_wait_for_it() -> None:
    world = World(speeds=(115200,), powered=False)
    world.run(1)
    program = ShareProgram(world)
    program.ask(PID)
    world.naze.power_on_booted(world.now)
    world.run(3)
    assert [frame.direction for _, frame in program.replies] == [Direction.REPLY]
    world.power_off()
    world.run(5)
    program.ask(PID, wait_s=4)
    assert len(program.replies) == 1
    assert program.closed_at is not None
