# SPDX-License-Identifier: GPL-3.0-or-later
"""An INAV's landing approaches: SET_WP and SET_SAFEHOME erase them, and the bridge writes them again."""

from dataclasses import replace

import pytest

from protocols.mission_item import Command, MissionResult
from protocols.msp.inav_places import FW_APPROACH, SET_FW_APPROACH, SET_SAFEHOME, FwApproach, decode_approach
from simulator.board.msp_board import MspBoard
from simulator.inav.firmware import InavFirmware
from simulator.inav.places import InavPlaces
from tests.bridge.controllers.inav.test_mission_store import ACCEPTED, board_with
from tests.bridge.controllers.inav.test_place_store import RALLY, RALLY_ITEMS, place, read, refuse
from tests.bridge.controllers.nav.test_mission_store import plan
from tests.support.conversations import Upload
from tests.support.nav_lists import HOME, LAT, LON, RTL_LANDS, WP

_PLANE = 1


def places_of(board: MspBoard) -> InavPlaces:
    assert isinstance(board._firmware, InavFirmware)
    return board._firmware._places


def approach(number: int) -> FwApproach:
    return FwApproach(number, 4000 + number, 100, headings=(-90, 0))


def set_approaches(board: MspBoard, *numbers: int) -> None:
    for number in numbers:
        places_of(board).answer(SET_FW_APPROACH, approach(number).pack())


def approaches_of(board: MspBoard) -> list[FwApproach | None]:
    return [decode_approach(places_of(board).answer(FW_APPROACH, bytes((n,))) or b"") for n in range(17)]


@pytest.mark.parametrize("platform", [0, _PLANE])
def test_writes_of_missions_keep_all_approaches_and_save_them(platform: int) -> None:
    """The platform is that of the active profile: a VTOL may be a copter when it is written to."""
    board, world, station = board_with(version="9.1.0", platform=platform)
    set_approaches(board, *range(17))
    world.inside.missions.settings_changed()
    for size in (3, 9, 14):
        assert Upload(station, plan(size)).run() is ACCEPTED
        assert approaches_of(board) == [approach(number) for number in range(17)]
    board.power_off(world.now)
    board.power_on_booted(world.now)
    world.run(1)
    assert approaches_of(board) == [approach(number) for number in range(17)]


def test_an_approach_that_another_client_has_set_since_is_kept() -> None:
    board, _, station = board_with(version="9.1.0", platform=_PLANE)
    assert Upload(station, plan(3)).run() is ACCEPTED
    set_approaches(board, 8)
    assert Upload(station, plan(4)).run() is ACCEPTED
    assert approaches_of(board)[8] == approach(8)


def test_a_mission_is_not_saved_without_the_approach(monkeypatch: pytest.MonkeyPatch) -> None:
    board, _, station = board_with(version="9.1.0", platform=_PLANE)
    set_approaches(board, 8)
    places_of(board).save()
    refuse(monkeypatch, board, SET_FW_APPROACH, times=99)
    assert Upload(station, plan(3)).run() is MissionResult.DENIED
    assert board._firmware.stored == []  # type: ignore[union-attr]


def test_rally_points_keep_their_approaches_in_any_order() -> None:
    board, _, station = board_with(version="9.1.0")
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    set_approaches(board, 0, 1, 2)
    first, second, third = RALLY_ITEMS
    as_float = replace(first, lat_e7=(first.lat_e7 or 0) + 38)
    assert Upload(station, [third, as_float, second], mission_type=RALLY).run() is ACCEPTED
    assert approaches_of(board)[:4] == [approach(0), approach(1), approach(2), FwApproach(3)]
    assert [item.lat_e7 for item in read(station, RALLY)] == [as_float.lat_e7, second.lat_e7, third.lat_e7]


def test_a_deleted_or_moved_rally_points_approach_is_named_and_not_inherited() -> None:
    board, _, station = board_with(version="9.1.0")
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    set_approaches(board, 0, 1)
    new = [*RALLY_ITEMS[1:], place(Command.RALLY_POINT, 700)]
    assert Upload(station, new, mission_type=RALLY).run() is ACCEPTED
    assert approaches_of(board)[:2] == [FwApproach(0), approach(1)]
    lost = "Safehome 0 was deleted or moved, and lost FW approach 0"
    assert lost in " ".join(station.texts())


def test_an_approach_of_a_place_that_is_not_a_rally_point_is_cleared() -> None:
    board, _, station = board_with(version="9.1.0")
    set_approaches(board, 0, 5)
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    assert approaches_of(board)[:6] == [FwApproach(number) for number in range(6)]


def test_a_refused_rally_point_leaves_the_old_points_with_their_approaches(monkeypatch: pytest.MonkeyPatch) -> None:
    board, _, station = board_with(version="9.1.0")
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is ACCEPTED
    set_approaches(board, 0, 1, 2)
    refuse(monkeypatch, board, SET_SAFEHOME, times=1, number=2)
    new = [place(Command.RALLY_POINT, north) for north in (2000, 3000, 4000)]
    assert Upload(station, new, mission_type=RALLY).run() is MissionResult.DENIED
    assert "old kept" in " ".join(station.texts())
    assert approaches_of(board)[:3] == [approach(0), approach(1), approach(2)]


def test_an_aeroplanes_return_names_the_approach_of_rally_points_written_since_the_last_mission() -> None:
    _, _, station = board_with(version="9.1.0", platform=_PLANE)
    there = replace(WP, lat_e7=LAT + 5000, lon_e7=LON)
    assert Upload(station, [HOME, there, RTL_LANDS]).run() is ACCEPTED
    assert "circles down and lands in any direction: no FW approach" in " ".join(station.texts())
    rally = replace(RALLY_ITEMS[0], lat_e7=there.lat_e7, lon_e7=there.lon_e7)
    assert Upload(station, [rally], mission_type=RALLY).run() is ACCEPTED
    assert Upload(station, [HOME, there, RTL_LANDS]).run() is ACCEPTED
    assert "circles down and lands in any direction: no FW approach" in " ".join(station.texts())
