# SPDX-License-Identifier: GPL-3.0-or-later
"""Fences and rally points: the board decides if they are stored, also while it is lost."""

from bridge.line.runner import Runner
from bridge.missions.mission_service import NO_LINK
from bridge.missions.place_lists import NO_PLACES, PlaceLists
from bridge.model.vehicle import Vehicle
from tests.bridge.controllers.inav.test_mission_store import board_with
from tests.bridge.controllers.inav.test_place_store import RALLY, RALLY_ITEMS
from tests.support.conversations import Upload


def test_before_a_board_is_found_none_are_stored() -> None:
    lists = PlaceLists(RALLY, "Rally points", Vehicle(), Runner(lambda _effect: None), lambda: None)
    lists.use(NO_LINK, 0.0, is_same_board=True)
    assert lists.fc_store is NO_PLACES
    assert not lists.are_stored


def test_a_lost_board_that_stores_them_is_not_a_board_without() -> None:
    _, world, station = board_with()
    world.unplug()
    world.run(6)
    assert Upload(station, RALLY_ITEMS, mission_type=RALLY).run() is not None
    assert "No fences or rally points" not in " ".join(station.texts())
    assert "No link to the flight controller" in " ".join(station.texts())
