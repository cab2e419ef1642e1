# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists that change on the board without the bridge are noticed, read and reported."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.msp.nav import Nav
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import FLAG_LAST, WAYPOINT_SIZE, unpack_waypoint
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board, new_eeprom
from simulator.inav.boxes import BOXES
from simulator.inav.mission import CAPACITY
from simulator.multiwii.mission import MultiWiiMission
from tests.bridge.controllers.inav.test_mission_store import ACCEPTED, board_with
from tests.bridge.controllers.nav.test_mission_store import packed, plan
from tests.bridge.controllers.nav.test_stored_missions import Bench, records, sets
from tests.support.conversations import Upload
from tests.support.msp_bench import waypoint
from tests.support.world import GroundStation, World, ready_world

NAV_WP = 1 << BOXES["9.1.0"].index(28)


@pytest.mark.parametrize("armed", [False, True])
def test_a_mission_selected_by_sticks_is_noticed_within_two_seconds(armed: bool) -> None:
    bench = Bench(4, 6)
    bench.faults.armed = armed
    bench.world.run(3)
    bench.faults.selected_mission = 2
    bench.world.run(2.0)
    assert records(bench.world.bridge.missions.held) == sets(4, 6)[1]
    assert "changed: 6 records" in bench.text()


def test_another_clients_list_is_noticed_and_the_progress_is_correct() -> None:
    bench = Bench(9)
    assert Upload(bench.station, plan(21, 7)).run() is ACCEPTED
    bench.eeprom[: 4 * WAYPOINT_SIZE] = b"".join(
        bytes((number,)) + record for number, record in enumerate(sets(4)[0], 1)
    )
    bench.faults.stick_loads += 1
    bench.world.run(2.0)
    assert "changed: 4 records" in bench.text()
    assert records(bench.world.bridge.missions.held) == sets(4)[0]
    bench.faults.armed, bench.faults.boxes = True, NAV_WP
    bench.world.run(5)
    assert {message.total for message in bench.station.messages("MISSION_CURRENT")[-3:]} == {4}


@pytest.mark.parametrize("size", [3, 30])
@pytest.mark.parametrize("kind", ["inav", "multiwii"])
def test_a_list_of_the_same_size_is_noticed_within_two_seconds(kind: str, size: int) -> None:
    """Another client has moved one waypoint."""
    options = MspOptions(serial_task_ms=10.0)
    eeprom = new_eeprom(kind, options)
    board = make_board(kind, options, Faults(boxes=0), memoryview(eeprom))
    world = ready_world(peer=board)
    world.run(2)
    station = GroundStation(world)
    assert Upload(station, plan(size + 1), tries=60).run(60) is ACCEPTED
    world.run(3)
    moved = plan(size + 1)
    moved[size // 2] = replace(moved[size // 2], alt_m=33.0)
    changed = packed(moved)[size // 2 - 1]
    if kind == "inav":
        eeprom[(size // 2 - 1) * WAYPOINT_SIZE + 1 : size // 2 * WAYPOINT_SIZE] = changed
        board._firmware._mission.load()  # type: ignore[union-attr]
    else:
        MultiWiiMission(memoryview(eeprom), options.capacity).store(size // 2, unpack_waypoint(b"\0" + changed)[1])
    world.run(2.0)
    assert f"Mission on board changed: {size} records" in " ".join(station.texts())
    assert records(world.bridge.missions.held) == packed(moved)


def with_the_longest_list(streams_hz: int = 0) -> tuple[MspBoard, World, GroundStation]:
    """The board serves one request per 10 ms. Above 0, a ground station requests all telemetry at this rate."""
    board, world, station = board_with(serial_task_ms=10.0)
    assert Upload(station, plan(CAPACITY + 1)).run(60) is ACCEPTED
    for stream in range(1, 13) if streams_hz else ():
        station.send(messages.MAVLink_request_data_stream_message(1, 1, stream, streams_hz, 1))
    return board, world, station


def write(board: MspBoard, mission: list[bytes], then: Callable[[], None] = lambda: None) -> None:
    """Another client writes these records, and does something after each."""
    for number, record in enumerate(mission, 1):
        board._firmware._mission.write(number, unpack_waypoint(bytes((number,)) + record)[1])  # type: ignore[union-attr]
        then()


def test_another_list_of_the_longest_size_is_noticed_within_two_seconds() -> None:
    board, world, station = with_the_longest_list(50)
    world.run(3)
    other = packed(plan(CAPACITY + 1, 3))
    write(board, other)
    world.run(2.0)
    assert f"Mission on board changed: {CAPACITY} records" in " ".join(station.texts())
    assert records(world.bridge.missions.held) == other


def test_one_changed_record_in_the_longest_list_is_noticed_from_the_upload() -> None:
    board, world, station = with_the_longest_list()
    world.run(3)
    _, *others = packed(plan(CAPACITY + 1))
    write(board, [packed(plan(CAPACITY + 1, 3))[0], *others], lambda: world.run(0.01))
    world.run(2.0)
    assert f"Mission on board changed: {CAPACITY} records" in " ".join(station.texts())


def test_a_reloaded_earlier_list_is_noticed_within_six_seconds() -> None:
    """Another client has changed one of many records without saving, and loads the saved list."""
    board, world, _ = with_the_longest_list(50)
    ours = packed(plan(CAPACITY + 1))
    changed = [*ours[:76], packed(plan(CAPACITY + 1, 3))[76], *ours[77:]]
    write(board, changed)
    world.run(10)
    assert records(world.bridge.missions.held) == changed
    board._firmware._mission.load()  # type: ignore[union-attr]
    world.run(6.5)
    assert records(world.bridge.missions.held) == ours


def test_a_list_that_the_sticks_load_is_noticed_within_six_seconds() -> None:
    """It is of the longest size, has never been seen, and differs in one record."""
    board, world, _ = with_the_longest_list(50)
    for number in (1, 119):
        world.run(3)
        changed = packed(plan(CAPACITY + 1, 7))[number - 1]
        board._eeprom[(number - 1) * WAYPOINT_SIZE + 1 : number * WAYPOINT_SIZE] = changed
        board.faults.stick_loads += 1
        world.run(6.5)
        assert records(world.bridge.missions.held)[number - 1] == changed


def test_a_list_that_another_client_is_writing_is_reported_once_it_is_complete() -> None:
    bench = Bench(9)
    before = len(bench.station.texts())
    mission = bench.board._firmware._mission  # type: ignore[union-attr]
    for number in range(1, 31):
        mission.write(number, waypoint(number, flag=FLAG_LAST if number == 30 else 0))
        bench.world.run(0.1)
    bench.world.run(2)
    text = " ".join(bench.station.texts()[before:])
    assert text == "Mission on board changed: 30 records"


def test_a_list_that_another_client_left_unfinished_is_reported() -> None:
    bench = Bench(9)
    bench.board._firmware._mission.write(1, waypoint(1))  # type: ignore[union-attr]
    bench.world.run(2)
    assert "Mission on board changed: 0 records" in bench.text()


def test_a_multiwii_is_not_read_in_flight() -> None:
    """Reading a record would change the record that it flies."""
    board, world, station = board_with("multiwii")
    assert Upload(station, plan(9), tries=60).run(60) is ACCEPTED
    board.faults.armed, board.faults.boxes = True, 1 << 10
    world.run(2)
    asked = world.requests_during(5)
    assert not [frame for frame in asked if frame.command == Nav.WP and frame.payload != b"\0"]
    board.faults.armed = False
    world.run(5)
    assert not [text for text in station.texts() if "changed" in text]


def test_polling_an_empty_multiwii_does_not_report_changes() -> None:
    _, world, station = board_with("multiwii")
    asked = [frame.payload for frame in world.requests_during(5) if frame.command == Nav.WP]
    assert not [text for text in station.texts() if "changed" in text]
    assert [payload for payload in asked if payload[0] > 1] == []
