# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry and mission uploads work even if the SD card answers after minutes or never."""

from bridge.missions.mission_service import HeldMission
from bridge.model.missions import Outcome, Refusal
from protocols.mission_item import MissionResult
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import Download, Upload, records_of, waypoints
from tests.support.world import GroundStation, World, flash_holding, ready_world

NEVER = 1e9


def holding(count: int = 5) -> tuple[World, GroundStation]:
    world = ready_world(flash=flash_holding(records_of(waypoints(count))))
    return world, GroundStation(world)


def test_a_mission_is_accepted_while_mission_planner_still_waits() -> None:
    world, station = holding()
    world.store.delay_s = NEVER
    items = waypoints(20)
    # Mission Planner repeats its last item for 5 s.
    assert Upload(station, items).run(4.5) is MissionResult.ACCEPTED
    assert world.stored == records_of(items)
    assert "The mission could not be stored on the Pi" in station.texts()


def inav_of(serial_task_ms: float) -> tuple[World, GroundStation]:
    board = make_board("inav", MspOptions(serial_task_ms=serial_task_ms), Faults(boxes=0))
    world = ready_world(peer=board)
    return world, GroundStation(world)


def test_a_hanging_disk_delays_the_ack_of_a_short_write_by_less_than_two_seconds() -> None:
    world, station = inav_of(serial_task_ms=0.5)
    upload = Upload(station, waypoints(9))
    world.store.delay_s = NEVER
    assert upload.run(2.0) is MissionResult.ACCEPTED


def test_a_slow_disk_stores_the_mission_while_the_board_writes_it() -> None:
    """INAV serves one request per 10 ms: 120 records take 2.4 s, which the disk may take, too."""
    world, station = inav_of(serial_task_ms=10.0)
    items = waypoints(121)
    world.store.delay_s = 2.9
    upload = Upload(station, items)
    world.wait_until(lambda w: bool(w.store.missions), 10)
    world.store.delay_s = 0.0
    assert upload.run(2.0) is MissionResult.ACCEPTED
    assert "The mission could not be stored on the Pi" not in station.texts()
    assert world.store.outcomes() == [Outcome.VERIFIED]


def test_a_disk_that_hangs_after_the_push_does_not_delay_the_ack() -> None:
    world, station = holding()
    upload = Upload(station, waypoints(20))
    world.wait_until(lambda w: bool(w.store.missions), 10)
    world.store.delay_s = NEVER
    assert upload.run(4.5) is MissionResult.ACCEPTED
    assert "The mission could not be stored on the Pi" in station.texts()
    assert world.store.outcomes() == [None]


def test_the_flight_controller_is_still_found_and_read() -> None:
    world = World(speeds=(115200,), flash=flash_holding(records_of(waypoints(5))))
    world.store.delay_s = NEVER
    world.wait_ready(8)
    world.unplug()
    world.plug()
    world.wait_ready(8)
    assert len(Download(GroundStation(world)).run(10)) == 5


def test_a_list_is_dropped_if_the_board_leaves_before_the_store_answers() -> None:
    world, _ = holding()
    world.inside.missions.held = None
    world.store.delay_s = 2.0
    answers: list[HeldMission | Refusal] = []
    world.bridge.missions.pull(answers.append, world.now)
    world.run(1)
    assert not answers
    world.unplug()
    world.wait_until(lambda _: bool(answers), 3)
    assert isinstance(answers[0], HeldMission)
    assert world.bridge.missions.held is None


def test_a_late_reply_of_the_store_is_dropped() -> None:
    """The card resumes after 10 s: its reply for the first mission must not count for the second."""
    world, station = holding()
    world.store.delay_s = 10.0
    assert Upload(station, waypoints(6, 1)).run(8) is MissionResult.ACCEPTED
    world.run(3)
    world.store.delay_s = 0.0
    second = waypoints(7, 2)
    assert Upload(station, second).run(8) is MissionResult.ACCEPTED
    world.run(20)
    ended = [(mission.items, end and end.outcome) for mission, end in world.store.missions]
    assert [(items, outcome) for items, outcome in ended if outcome] == [(tuple(second), Outcome.VERIFIED)]
