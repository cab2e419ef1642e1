# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV with several stored missions, and lists changed on the board by other programs."""

from collections import Counter
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.missions.mission_service import HeldMission
from bridge.model.missions import Outcome, Refusal
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from protocols.msp.nav import LAST, Nav
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import WAYPOINT_SIZE, NavWaypoint
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.inav.mission import CAPACITY, EEPROM_SIZE
from simulator.inav.places import PLACES_SIZE
from simulator.inav.settings import SETTINGS_SIZE
from tests.bridge.controllers.inav.test_mission_store import ACCEPTED, board_with, without_home
from tests.bridge.controllers.nav.test_mission_store import packed, plan
from tests.support.conversations import Download, Upload, clear_message
from tests.support.world import GroundStation, World

NOTHING_MORE = NavWaypoint().pack(0)[1:]


class Bench:
    """A board whose EEPROM has missions of the given sizes from another planner."""

    def __init__(self, *sizes: int, faults: Faults | None = None) -> None:
        records = [record for mission in sets(*sizes) for record in mission]
        filled = records + [NOTHING_MORE] * (CAPACITY - len(records))
        missions = b"".join(bytes((number,)) + record for number, record in enumerate(filled, 1))
        self.eeprom = bytearray(missions + bytes(SETTINGS_SIZE + PLACES_SIZE))
        self.faults = faults or Faults(boxes=0)
        self.board: MspBoard = make_board("inav", MspOptions(), self.faults, memoryview(self.eeprom))
        self.world = World(speeds=(115200,), peer=self.board, plugged=False)
        self.station = GroundStation(self.world)
        self.station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), wait_s=0.5)
        self.world.plug()
        self.world.wait_ready(10, then_s=5)

    def stored(self) -> list[list[bytes]]:
        """The missions in the EEPROM, without record numbers."""
        records = [bytes(self.eeprom[at + 1 : at + WAYPOINT_SIZE]) for at in range(0, EEPROM_SIZE, WAYPOINT_SIZE)]
        missions: list[list[bytes]] = [[]]
        for record in records:
            missions[-1].append(record)
            if record[-1] == LAST:
                missions.append([])
        return [mission for mission in missions if mission and mission != [NOTHING_MORE]]

    def flown(self) -> list[bytes]:
        """The list that the board would fly if armed now."""
        self.world.arm(then_s=3)
        assert self.board.armed
        held = self.world.bridge.missions.held
        self.faults.armed = False
        self.world.run(3)
        return records(held)

    def text(self) -> str:
        """All texts so far; long ones arrive in pieces."""
        self.world.run(0.1)
        return " ".join(self.station.texts())


def sets(*sizes: int) -> list[list[bytes]]:
    return [packed(plan(size + 1, shift)) for shift, size in enumerate(sizes, 1)]


def records(mission: HeldMission | None) -> list[bytes]:
    return [] if mission is None else [record.pack() for record in mission.records]


def others_of(bench: Bench) -> list[list[bytes]]:
    return [records(held) for held in bench.world.bridge.missions.others]


# -- several missions ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("selected", [1, 2, 3])
def test_a_download_shows_the_loaded_mission(selected: int) -> None:
    bench = Bench(4, 6, 9, faults=Faults(boxes=0, selected_mission=selected))
    shown = Download(bench.station).run()
    assert without_home(shown) == without_home(plan((5, 7, 10)[selected - 1], selected))
    assert others_of(bench) == [mission for number, mission in enumerate(sets(4, 6, 9), 1) if number != selected]


@pytest.mark.parametrize("selected", [1, 2])
def test_an_upload_replaces_the_loaded_mission_and_keeps_the_others(selected: int) -> None:
    bench = Bench(4, 6, 9, faults=Faults(boxes=0, selected_mission=selected))
    bench.faults.selected_mission = 0
    assert Upload(bench.station, plan(21, 7)).run() is ACCEPTED
    kept = [mission for number, mission in enumerate(sets(4, 6, 9), 1) if number != selected]
    assert bench.stored() == [packed(plan(21, 7)), *kept]
    assert without_home(Download(bench.station).run()) == without_home(plan(21, 7))
    assert bench.flown() == packed(plan(21, 7))
    bench.world.run(3)
    assert others_of(bench) == kept


def test_a_list_that_does_not_fit_with_the_other_missions_is_refused() -> None:
    bench = Bench(4, 30, 60)
    assert Upload(bench.station, plan(32, 7)).run() is MissionResult.NO_SPACE
    assert "more than the 30 that fit with the board's other missions" in bench.text()
    assert bench.stored() == sets(4, 30, 60)
    assert Upload(bench.station, plan(31, 7)).run() is ACCEPTED


def test_clear_clears_the_loaded_mission() -> None:
    bench = Bench(4, 6)
    bench.station.send(clear_message())
    bench.world.run(3)
    assert bench.stored()[-1] == sets(4, 6)[1]
    assert Download(bench.station).run()[1:] == []
    assert bench.flown() == []


def test_after_a_failed_push_all_missions_are_restored() -> None:
    bench = Bench(4, 6)
    upload = Upload(bench.station, plan(100, 7))
    bench.world.run(0.4)
    bench.world.bridge.abort(bench.world.now)
    upload.run(2)
    bench.world.run(3)
    assert bench.stored() == sets(4, 6)
    assert bench.flown() == sets(4, 6)[0]


# -- a list that changes on the board ------------------------------------------------------------------------


def restart(bench: Bench) -> None:
    bench.board.power_off(bench.world.now)
    bench.world.run(3)
    bench.board.power_on(bench.world.now)
    bench.world.wait_until(lambda w: w.is_found, 15, then_s=3)


def test_after_a_restart_the_saved_mission_is_loaded_and_reported() -> None:
    bench = Bench()
    assert Upload(bench.station, plan(13)).run() is ACCEPTED
    restart(bench)
    assert without_home(Download(bench.station).run()) == without_home(plan(13))
    assert "Saved mission loaded again: 12 records" in bench.text()
    assert bench.flown() == packed(plan(13))


def test_a_saved_mission_from_another_planner_is_reported_as_such() -> None:
    bench = Bench(4)
    assert "not written by naze-bridge" in bench.text()
    assert bench.flown() == sets(4)[0]


def test_while_armed_the_missing_mission_is_reported_but_not_loaded() -> None:
    bench = Bench(4, faults=Faults(boxes=0, armed=True))
    assert bench.text().count("No mission is loaded: disarm to load it") == 1
    # None is loaded, so there is nothing to fly.
    assert without_home(Download(bench.station).run()) == []
    bench.faults.armed = False
    bench.world.run(3)
    assert without_home(Download(bench.station).run()) == without_home(plan(5, 1))


@pytest.mark.parametrize("command", [Msp.STATUS, Nav.GETINFO, Nav.LOAD])
@pytest.mark.parametrize("lost", [3, 12])
def test_a_list_that_is_not_loaded_yet_is_not_read_as_empty(command: int, lost: int) -> None:
    """Until the board has answered and loaded its saved mission, reading fails."""
    bench = Bench(4)
    bench.board.power_off(bench.world.now)
    bench.world.run(3)
    requests = Counter[int]()
    receive, frames = bench.board.receive, MspParser()

    def receive_others(data: bytes, now: float) -> None:
        for frame in frames.feed(data):
            requests[frame.command] += 1
            if not bench.world.is_found or frame.command != command or requests[command] > lost:
                receive(frame.encode(), now)

    bench.board.receive = receive_others  # type: ignore[method-assign]
    bench.board.power_on(bench.world.now)
    bench.world.wait_until(lambda world: world.is_found, 30)
    requests.clear()
    while isinstance(held := bench.world.pull(), Refusal):
        pass
    assert records(held) == sets(4)[0]
    bench.world.run(2)
    assert "Saved mission loaded, not written by naze-bridge: 4 records" in bench.text()


@pytest.mark.parametrize("is_blank", [False, True])
def test_after_a_read_a_multiwii_still_hovers_at_the_end_of_a_return_home(is_blank: bool) -> None:
    """It would land if the last record read had a p1 (a hold, or an erased record)."""
    board, world, station = board_with("multiwii")
    if not is_blank:
        items = [replace(item, p1=7.0) for item in plan(9)]
        assert Upload(station, items, tries=60).run(60) is ACCEPTED
        world.run(3)
        assert Download(station).run() is not None
    written = board.counters.flash_writes
    world.run(3)
    board.faults.armed, board.faults.boxes = True, 1 << 7
    world.run(40)
    craft = board.truth(world.now)
    assert craft is not None
    assert craft.flight.height_m > 5
    assert board.counters.flash_writes == written


def test_after_a_push_that_fails_for_good_the_saved_mission_is_loaded() -> None:
    bench = Bench()
    assert Upload(bench.station, plan(13)).run() is ACCEPTED
    upload = Upload(bench.station, plan(100, 1))
    bench.world.after(0.5, lambda: setattr(bench.faults, "armed", True))
    assert upload.run() is not ACCEPTED
    bench.world.run(1)
    bench.faults.armed = False
    bench.world.run(4)
    assert without_home(Download(bench.station).run()) == without_home(plan(13))
    assert "Saved mission loaded again" in bench.text()
    assert bench.world.store.outcomes().count(Outcome.VERIFIED) == 1


@pytest.mark.parametrize("selected", [1, 2])
def test_another_clients_change_to_a_mission_that_is_not_loaded_is_kept(selected: int) -> None:
    """The sizes, the selection and the loaded mission are as before."""
    bench = Bench(4, 6, faults=Faults(boxes=0, selected_mission=selected))
    bench.faults.selected_mission = 0
    missions = sets(4, 6)
    changed = missions[2 - selected] = packed(plan(7 - 2 * (selected - 1), 9))
    store(bench, *missions)
    bench.world.run(4)
    assert Upload(bench.station, plan(21, 7)).run() is ACCEPTED
    assert bench.stored() == [packed(plan(21, 7)), changed]


def test_a_write_is_refused_if_the_other_missions_are_unreadable() -> None:
    """Another client writes a list just before the push, and reading it fails."""
    bench = Bench(4, 6)
    receive, frames = bench.board.receive, MspParser()
    lost: list[int] = []

    def receive_others(data: bytes, now: float) -> None:
        for frame in frames.feed(data):
            if bench.world.inside.missions.writing and not lost:
                store(bench, *sets(5, 7))
            if bench.world.inside.missions.writing and frame.command == Nav.WP and len(lost) < 5:
                lost.append(frame.command)
            else:
                receive(frame.encode(), now)

    bench.board.receive = receive_others  # type: ignore[method-assign]
    assert Upload(bench.station, plan(21, 7)).run(5) is MissionResult.DENIED
    assert lost
    bench.world.run(5)
    assert bench.stored() == sets(5, 7)
    assert others_of(bench) == sets(5, 7)[1:]


def store(bench: Bench, *missions: list[bytes]) -> None:
    """Another client writes and saves these missions."""
    for number, record in enumerate((record for mission in missions for record in mission), 1):
        bench.eeprom[(number - 1) * WAYPOINT_SIZE + 1 : number * WAYPOINT_SIZE] = record
    bench.board._firmware._mission.load()  # type: ignore[union-attr]
