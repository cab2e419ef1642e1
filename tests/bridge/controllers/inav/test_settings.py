# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from protocols.mission_item import MissionResult
from protocols.param_file import read_param_file, write_param_file
from simulator.commands.fc_kinds import make_board
from simulator.inav.setting_table import SETTINGS as INAV_SETTINGS
from tests.support.conversations import Upload, waypoints
from tests.support.settings_client import SettingsClient
from tests.support.world import GroundStation, World


def asked(world: World) -> int:
    """The number of settings that were asked for."""
    return sum(data[:2] == b"$X" and data[4:6] == b"\x07\x10" for _, _, data in world.written)


def test_a_mission_is_not_kept_waiting_by_a_reading() -> None:
    """An INAV's settings take seconds: its reading stops for the upload, and goes on where it was."""
    world = World(speeds=(115200,), peer=make_board("inav"))
    world.wait_until(lambda world: asked(world) > 30, 30)
    station = GroundStation(world)
    upload = Upload(station, waypoints(5))
    assert upload.run(2) is MissionResult.ACCEPTED
    assert SettingsClient(world).wait_read().is_complete
    assert asked(world) < 1.3 * len(INAV_SETTINGS)


def test_a_setting_with_an_impossible_name_is_left_out_and_reported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its name would reach every ground station, and make a backup unreadable."""
    names = {"nav_max_altitude": "a\x1b[2J", "nav_rth_altitude": "b\nc,9", "nav_wp_radius": "[/x]"}
    settings = tuple(setting._replace(name=names.get(setting.name, setting.name)) for setting in INAV_SETTINGS)
    monkeypatch.setattr("simulator.inav.settings.SETTINGS", settings)
    world = World(speeds=(115200,), peer=make_board("inav"))
    table = SettingsClient(world).wait_read(60)
    assert (table.left_out, table.is_complete, "[/x]" in table.settings) == (2, True, True)
    world.run(60)
    assert [event.facts["left_out"] for event in world.events("settings.read")] == [2]
    text = write_param_file({setting.name: setting.value for setting in table})
    assert read_param_file(text.encode(), "backup").values.keys() == table.settings.keys()
