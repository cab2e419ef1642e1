# SPDX-License-Identifier: GPL-3.0-or-later
from collections.abc import Mapping

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.model.settings import BoardId, Value
from protocols.mission_item import MissionResult
from protocols.msp.frame import request
from protocols.msp.inav_settings import COMMON_SET_SETTING, encode_about_name
from protocols.param_file import read_param_file, write_param_file
from simulator.board.msp_options import MspOptions
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


def test_a_setting_with_an_impossible_name_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its name would reach every ground station, and make a backup unreadable."""
    names = {"nav_max_altitude": "a\x1b[2J", "nav_rth_altitude": "b\nc,9", "nav_wp_radius": "[/x]"}
    settings = tuple(setting._replace(name=names.get(setting.name, setting.name)) for setting in INAV_SETTINGS)
    monkeypatch.setattr("simulator.inav.settings.SETTINGS", settings)
    world = World(speeds=(115200,), peer=make_board("inav"))
    table = SettingsClient(world).wait_read(60)
    assert (table.is_complete, {*names.values()} & table.settings.keys()) == (True, {"[/x]"})
    text = write_param_file({setting.name: setting.value for setting in table})
    assert read_param_file(text.encode(), "backup").values.keys() == table.settings.keys()


def test_a_list_is_complete_right_after_a_start_if_the_board_is_known() -> None:
    """Reading all takes 20 s; the values are those of the last time, and a change since then follows."""
    memory: dict[BoardId, Mapping[str, Value]] = {}
    options = MspOptions(baud=19200)  # as slow as the 800 settings of a whole INAV
    first = World(speeds=(19200,), peer=make_board("inav", options), memory=memory)
    count = len(SettingsClient(first).wait_read(60))
    board = make_board("inav", options)
    world = World(speeds=(19200,), peer=board, memory=memory)
    board.receive(request(COMMON_SET_SETTING, encode_about_name("nav_rth_altitude") + b"\x14\5"), 0.0)
    world.wait_until(lambda world: world.is_found, 20)
    station = GroundStation(world).stay_connected()
    station.send(m.MAVLink_param_request_list_message(1, 1), wait_s=8)
    listed = {each.param_id: each.param_value for each in station.messages("PARAM_VALUE")}
    assert len(listed) == station.messages("PARAM_VALUE")[-1].param_count > count - 60
    assert listed["NAV_RTH_ALTITUDE"] == 1000
    assert asked(world) < count
    station.send(m.MAVLink_param_set_message(1, 1, b"NAV_RTH_ALTITUDE", 1200, 9), wait_s=1)
    assert len(station.messages("PARAM_ERROR")) == 1
    world.run(30)
    (follows,) = [each for each in station.messages("PARAM_VALUE")[len(listed) :] if each.param_value == 1300]
    assert follows.param_id == "NAV_RTH_ALTITUDE"
    assert (
        world.events("settings.changed_on_board")[0].facts["detail"] == "Settings changed elsewhere: nav_rth_altitude"
    )
