# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs keep a live display while the craft is armed, and none of their requests reaches the line."""

import pytest

from protocols.msp.frame import Direction, request
from simulator.commands.fc_kinds import make_board
from tests.support.share_program import ShareProgram
from tests.support.world import GroundStation, World, ready_world

STATUS, RAW_IMU, SERVO, MOTOR, RC, RAW_GPS, COMP_GPS, ATTITUDE, ALTITUDE, ANALOG = range(101, 111)
BOX, WP, NAV_STATUS, STATUS_EX, SENSOR_STATUS, DEBUG, PID = 113, 118, 121, 150, 151, 254, 112
NAME, WP_GETINFO = 10, 20
INAV_STATUS, INAV_ANALOG, INAV_MIXER = 0x2000, 0x2002, 0x2010
#: The poll loops: INAV Configurator's js/periodicStatusUpdater.js with the Setup and GPS tabs, and build_pollreqs() in
#: mwp's mwp-handle_serial.vala, MultiWiiConf's draw(). In flight mwp leaves out GPSSTATISTICS.
CONFIGURATOR = (SENSOR_STATUS, INAV_STATUS, BOX, INAV_ANALOG, ATTITUDE, RAW_GPS, COMP_GPS, RC)
MWP_INAV = (INAV_STATUS, INAV_ANALOG, NAV_STATUS, RAW_GPS, COMP_GPS, WP, ATTITUDE, ALTITUDE)
MWP_MULTIWII = (STATUS, ANALOG, NAV_STATUS, RAW_GPS, COMP_GPS, WP, ATTITUDE, ALTITUDE)
MWP_HARAKIRI = (STATUS, ANALOG, RAW_GPS, COMP_GPS, WP, ATTITUDE, ALTITUDE)
MULTIWIICONF = (STATUS, RAW_IMU, SERVO, MOTOR, RC, RAW_GPS, COMP_GPS, ALTITUDE, ANALOG, DEBUG, ATTITUDE)


def ready(kind: str) -> World:
    world = ready_world(peer=None if kind == "harakiri" else make_board(kind), within_s=30)
    world.run(3)
    return world


def arm(world: World) -> None:
    world.arm(5, then_s=0.3)


@pytest.mark.parametrize(
    ("kind", "loop", "is_connected_before"),
    [
        ("inav", CONFIGURATOR, True),
        ("inav", MWP_INAV, False),
        ("multiwii", MWP_MULTIWII, True),
        ("harakiri", MWP_HARAKIRI, True),
        ("harakiri", MULTIWIICONF, False),
    ],
)
def test_a_display_stays_live_in_flight(kind: str, loop: tuple[int, ...], is_connected_before: bool) -> None:
    world = ready(kind)
    program = ShareProgram(world)
    if is_connected_before:
        program.ask_in_turn(0.005, loop)
        world.run(3)
    arm(world)
    if not is_connected_before:
        program.ask_in_turn(0.005, loop)
    program.replies.clear()
    world.run(1)
    sent = {frame.command for frame in world.requests_during(10)}
    assert program.closed_at is None
    counts = dict.fromkeys(loop, 0)
    for _, frame in program.replies:
        counts[frame.command] += 1
    # Once a second, and what the bridge had no poll for until now, too.
    assert min(counts.values()) >= 10
    # Polls, and the watch of the mission.
    assert sent <= {*world.inside.session.polls.commands, WP_GETINFO}


def test_values_in_flight_are_the_boards_last() -> None:
    world = ready("inav")
    arm(world)
    program = ShareProgram(world)
    program.ask_every(0.1, (ATTITUDE, b""), (RAW_GPS, b""))
    world.run(20)
    payloads = {frame.payload for _, frame in program.replies if frame.command == RAW_GPS}
    assert len(payloads) >= 5  # it flies
    asked_at, reply = program.replies[-2 if program.replies[-1][1].command == RAW_GPS else -1]
    assert reply.command == ATTITUDE
    assert world.now - asked_at < 1


def test_in_flight_other_requests_do_not_reach_the_line() -> None:
    world = ready("inav")
    arm(world)
    programs = [ShareProgram(world, f"192.0.2.{host}:1", may_write=True) for host in range(3)]
    world.written.clear()
    asked_at = world.now
    for program, command in zip(programs, (PID, INAV_MIXER, NAME), strict=True):
        program.ask(command, is_v2=True)
    world.run(4)
    sent = {frame.command for frame in world.requests()}
    assert not sent & {PID, INAV_MIXER, NAME}
    assert [program.closed_at for program in programs] == [pytest.approx(asked_at + 3, abs=0.3)] * 3
    assert {event.facts["why"] for event in world.events("share.refused")} == {"armed"}


def test_a_waiting_read_is_forwarded_once_the_craft_has_landed() -> None:
    world = ready("harakiri")
    arm(world)
    program = ShareProgram(world)
    program.ask(PID, wait_s=1)
    world.naze.faults.armed = False
    world.run(1.5)
    assert [frame.direction for _, frame in program.replies] == [Direction.REPLY]


def test_a_refused_poll_is_answered_with_the_boards_error() -> None:
    """Without its GPS a real INAV refuses GPSSTATISTICS; this model refuses the command of another program's poll."""
    world = ready("multiwii")
    program = ShareProgram(world)
    replies = [program.wait_for(SERVO, seconds=4) for _ in range(4)]
    arm(world)
    world.written.clear()
    replies += [program.wait_for(SERVO, seconds=4) for _ in range(4)]
    assert {reply.direction for reply in replies} == {Direction.ERROR}
    assert request(SERVO) not in b"".join(data for _, _, data in world.written)


@pytest.mark.parametrize("is_armed", [False, True])
def test_a_refused_write_is_not_a_warning(is_armed: bool) -> None:
    """A warning would cover what concerns the craft on Mission Planner's HUD."""
    world = ready("harakiri")
    if is_armed:
        arm(world)
    station = GroundStation(world).stay_connected(wait_s=2)
    ShareProgram(world).ask(202, bytes(30), wait_s=1)
    texts = [message for message in station.messages("STATUSTEXT") if "SET_PID refused" in message.text]
    assert [message.severity for message in texts] == [5], "MAV_SEVERITY_NOTICE"
