# SPDX-License-Identifier: GPL-3.0-or-later
"""A bug in a conversation ends only that one: its requester gets a result, and the next request works."""

from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.model.missions import Outcome, Refusal
from protocols.mission_item import MissionResult
from simulator.board.options import SimOptions
from tests.support.conversations import Download, Upload, records_of, waypoints
from tests.support.settings_client import SettingsClient
from tests.support.world import GroundStation, World, flash_holding, ready_world

ITEMS = waypoints(5)
HELD = waypoints(9, seed=77)


class BugError(Exception):
    """A bug in the bridge itself."""


def bug(*_args: object) -> Iterator[object]:
    yield from ()
    raise BugError


@pytest.fixture
def world() -> World:
    world = ready_world(SimOptions(), flash=flash_holding(records_of(HELD)))
    world.run(2)
    return world


def break_store(world: World, method: str) -> None:
    """The store of the flight controller fails until the line is searched again."""
    setattr(world.inside.missions.fc_store, method, bug)


def recover(world: World) -> None:
    """As Daemon._fault does."""
    with pytest.raises(BugError):
        world.run(10)
    world.bridge.restart("internal error", world.now)
    world.wait_until(lambda w: w.bridge.missions.held is not None, 30)


def test_a_download_works_again(world: World) -> None:
    station = GroundStation(world)
    break_store(world, "report")
    first = Download(station)
    recover(world)
    assert first.is_over
    assert len(Download(station).run()) == len(HELD)


@pytest.mark.parametrize("method", ["report", "push"])
def test_an_upload_works_again(world: World, method: str) -> None:
    station = GroundStation(world)
    break_store(world, method)
    first = Upload(station, ITEMS)
    recover(world)
    first.stop()
    assert Upload(station, ITEMS).run() is MissionResult.ACCEPTED


def test_a_local_push_is_answered_and_works_again(world: World) -> None:
    break_store(world, "push")
    outcome = world.push(ITEMS)
    recover(world)
    assert isinstance(outcome[0][0], Refusal)
    world.push(ITEMS)
    world.wait_until(lambda w: w.store.outcomes()[-1] is Outcome.VERIFIED, 30)


def test_a_parameter_can_be_set_again(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    station = GroundStation(world)
    wanted = m.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300.0, 9)
    fc_settings = world.inside.board_settings._fc_settings
    assert fc_settings is not None
    monkeypatch.setattr(fc_settings, "write", bug)
    station.send(wanted)
    recover(world)
    client = SettingsClient(world)
    client.current()
    station.send(wanted)
    world.wait_until(lambda _: client.value("gps_wp_radius") == 300, 20)


def test_the_list_is_watched_again(world: World) -> None:
    break_store(world, "is_current")
    recover(world)
    break_store(world, "is_current")
    with pytest.raises(BugError):
        world.run(10)
