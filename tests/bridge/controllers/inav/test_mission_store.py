# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions to the simulated INAV and MultiWii, which have every hazard of docs/inav.md."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.inav import profile as inav
from bridge.controllers.inav.limits import InavLimits
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.nav import Nav
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import BOXES
from tests.bridge.controllers.nav.test_mission_store import plan
from tests.support.conversations import Download, Upload
from tests.support.seeds import seeds
from tests.support.world import GroundStation, World, ready_world

ACCEPTED, DENIED = MissionResult.ACCEPTED, MissionResult.DENIED
MIXED = [
    (16, 0),
    (16, 7),
    (201, 0),
    (178, 4),
    (16, 0),
    (19, 9),
    (115, 90),
    (16, 0),
    (197, 0),
    (177, 5),
    (16, 0),
    (20, 1),
]


def board_with(
    kind: str = "inav", faults: Faults | None = None, **options: Any
) -> tuple[MspBoard, World, GroundStation]:
    board = make_board(kind, MspOptions(**options), faults or Faults(boxes=0))
    world = ready_world(peer=board, within_s=10)
    world.run(2)
    return board, world, GroundStation(world)


def mixed() -> list[MissionItem]:
    """Home and one item of each kind that INAV can hold."""
    home, *legs = plan(len(MIXED) + 1)
    items = []
    for leg, (command, p1) in zip(legs, MIXED, strict=True):
        is_place = command in (16, 19, 201)
        place = (leg.lat_e7, leg.lon_e7, leg.alt_m) if is_place else (0, 0, 0.0)
        p2 = 3.0 if command == 177 else 0.0
        params = (1.0, float(p1), 0.0, 0.0) if command == 178 else (float(p1), p2, 0.0, 0.0)
        items.append(MissionItem(leg.seq, command, 0 if is_place and leg.seq % 2 else 3, *params, *place))
    return [home, *items]


def without_home(items: list[MissionItem]) -> list[MissionItem]:
    """Home is read from the board, not from the list."""
    return items[1:]


@pytest.mark.parametrize("version", BOXES)
def test_a_mission_reads_back_as_sent_on_each_version(version: str) -> None:
    board, world, station = board_with(version=version)
    assert world.kind is inav.PROFILE
    sent = mixed()
    assert Upload(station, sent).run() is ACCEPTED
    assert world.store.missions[-1][0].verdict.findings == ()
    records = list(check_list(sent, NavRules(NavProfile())).records)
    assert [record[1:] for record in board.stored_records[: len(records)]] == [r.pack() for r in records]
    read = Download(station).run()
    assert without_home(read) == without_home(sent)
    assert Upload(station, read).run() is ACCEPTED
    assert world.store.missions[-1][0].verdict.findings == ()
    assert without_home(Download(station).run()) == without_home(sent)


@pytest.mark.parametrize("moment", [0.05, 0.5, 0.75, 0.8])
def test_arming_at_any_moment_never_flies_half_a_list(moment: float) -> None:
    board, world, station = board_with()
    assert Upload(station, plan(10)).run() is ACCEPTED
    upload = Upload(station, plan(100, 1))
    world.after(moment, lambda: setattr(board.faults, "armed", True))
    result = upload.run()
    world.run(1)
    board.faults.armed = False
    world.run(2)
    world.wait_ready()
    read = without_home(Download(station).run())
    assert read in ([], without_home(plan(10)), without_home(plan(100, 1)))
    assert (result is ACCEPTED) <= (read == without_home(plan(100, 1)))


@pytest.mark.parametrize("seed", seeds(3))
def test_damaged_bytes_are_free_of_hazards(seed: int) -> None:
    faults = Faults(boxes=0)
    board, world, station = board_with(faults=faults, version="7.1.2", seed=seed)
    faults.lost_byte_rate = faults.bit_error_rate = 5e-4
    result = Upload(station, plan(40, seed), tries=60).run(90)
    faults.lost_byte_rate = faults.bit_error_rate = 0.0
    world.run(3)
    world.wait_ready()
    assert (board.counters.cli_entered, board.counters.bootloader_entered, board.counters.crashes) == (False, False, 0)
    read = without_home(Download(station).run())
    assert read in ([], without_home(plan(40, seed)))
    assert (result is ACCEPTED) <= (read == without_home(plan(40, seed)))


def test_a_transfer_takes_little_more_than_the_time_on_the_wire() -> None:
    """Apart from the time until the board reads its port."""
    board, world, station = board_with(eeprom_write_ms=0.0, serial_task_ms=0.1)
    upload = Upload(station, plan(121))
    began = world.now
    while upload.result is None:
        world.run(0.001)
    assert [frame.command for frame in world.requests(began)].count(Nav.SET_WP) == 120
    wire_s = 120 * (27 + 6 + 7 + 27) * 10 / 115200
    assert world.now - began <= 1.15 * wire_s
    assert board.counters.rx_overflows == 0


def test_a_slow_board_gets_each_record_only_once() -> None:
    _, world, station = board_with(serial_task_ms=10.0)
    upload = Upload(station, plan(61))
    assert upload.run() is ACCEPTED
    assert without_home(Download(station).run()) == without_home(plan(61))
    assert [frame.command for frame in world.requests()].count(Nav.SET_WP) == 60


def test_polls_to_a_slow_board_are_not_lost() -> None:
    """The board serves one request per 10 ms."""
    _, world, station = board_with(serial_task_ms=10.0)
    assert Upload(station, plan(41)).run() is ACCEPTED
    assert world.inside.session.state.link is not None
    lost = world.inside.session.state.link.requests_lost
    for _ in range(5):
        station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), wait_s=1)
    assert world.inside.session.state.link.requests_lost == lost
    assert len(station.messages("ATTITUDE")) > 5 * 7


commands = st.sampled_from([16, 16, 16, 17, 18, 19, 20, 21, 80, 115, 177, 177, 177, 178, 197])
wild = st.builds(
    MissionItem,
    seq=st.just(0),
    command=commands,
    frame=st.sampled_from([0, 3]),
    p1=st.sampled_from([0.0, 1.0, 2.0, 3.0, 5.0, 90.0]),
    p2=st.sampled_from([0.0, -1.0, 1.0, 3.0]),
    p3=st.just(0.0),
    p4=st.just(0.0),
    lat_e7=st.integers(453830000, 453850000),
    lon_e7=st.integers(84730000, 84740000),
    alt_m=st.sampled_from([20.0, 50.0]),
)


@given(st.lists(wild, min_size=2, max_size=10))
@settings(max_examples=10)
def test_the_board_arms_with_any_list_that_the_rules_accept(items: list[MissionItem]) -> None:
    sent = [plan(1)[0], *items]
    if not check_list(sent, NavRules(NavProfile(limits=InavLimits()))).records:
        return
    board, world, station = board_with()
    assert Upload(station, sent).run() is ACCEPTED
    world.arm(then_s=2)
    assert board.armed
    assert board.counters.crashes == 0


@pytest.mark.parametrize("size", [21, 100, 192])
def test_an_unfinished_frame_in_the_parser_does_not_hide_the_board(size: int) -> None:
    """The parser has no timeout: it reads the bridge's requests as the rest of the frame."""
    board = make_board("inav", MspOptions())
    world = World(speeds=(115200,), peer=board, plugged=False)
    world.run(0.5)
    board.receive(bytes((ord("$"), ord("M"), ord("<"), size, Nav.SET_WP, 1)), world.now)
    world.run(0.5)
    world.plug()
    world.wait_until(lambda w: w.kind is inav.PROFILE, 15)
    assert Upload(GroundStation(world), plan(10)).run() is ACCEPTED
    assert not board.counters.cli_entered


@pytest.mark.parametrize("write_ms", [1100.0, 2200.0])
def test_a_slow_flash_write_does_not_fail_or_lose_the_link(write_ms: float) -> None:
    """An STM32H743 erases the sector of its settings in 1.1 s, at most 2.2 s."""
    board, world, station = board_with(eeprom_write_ms=write_ms, serial_task_ms=10.0)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    assert Upload(station, plan(21)).run(10) is ACCEPTED
    assert board.counters.flash_writes == 1
    world.run(5)
    assert not world.events("fc.lost")
