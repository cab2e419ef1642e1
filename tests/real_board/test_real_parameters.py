# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of the image as parameters through the whole bridge: listed, set, saved, refused while armed."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.model.settings import BoardSetting, SettingTable, Value, shown
from protocols.msp.frame import Direction, MspParser
from protocols.msp.setting_table import SettingCommand
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.real_bench import Figure
from tests.support.settings_client import SettingsClient
from tests.support.world import GroundStation, World

_BOOT_S = 30.0
_STICKS_S = 12.0
#: The commands that change or save a setting.
_CHANGES = {SettingCommand.SET_SETTING, 202, 203, 204, 207, 250}


@pytest.fixture
def world(image: Image, flash: bytes) -> World:
    return found(World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash)))))


def found(world: World) -> World:
    world.wait_until(lambda w: w.is_found and w.bridge.vehicle.armed is False, _BOOT_S)
    return world


def listed(table: SettingTable) -> list[BoardSetting]:
    return [setting for setting in table if not setting.name.startswith("BOX_")]


def test_telemetry_continues_during_the_first_list(world: World, figure: Figure) -> None:
    client, began = SettingsClient(world), world.now
    table = client.wait_read()
    took_s = world.now - began
    if len(listed(table)) < 100:
        pytest.skip("NOT RUN: an image without harakiri_settings.c")
    counts = f"{len(listed(table))} + {len(table) - len(listed(table))}"
    figure("settings and modes; s from found to all read", f"{counts}; {took_s:.2f}")
    assert took_s <= 2.0
    station = GroundStation(world)
    station.stay_connected()
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(2.0)
    found = {value.param_id for value in station.messages("PARAM_VALUE")}
    (count,) = {value.param_count for value in station.messages("PARAM_VALUE")}
    assert len(found) == count == 36 + len(table)
    figure("parameters in the list", count)
    assert world.naze.counters.hazard_runs == 0


def test_a_setting_is_set_saved_and_there_after_a_power_cycle(world: World, figure: Figure) -> None:
    client = SettingsClient(world)
    table = client.wait_read()
    changed = {}
    for name in ("p_roll", "bar_lag", "mag_dec", "looptime", "BOX_ANGLE"):
        setting = table.settings[name]
        value = float(setting.value) + 1 if name != "bar_lag" else 0.5
        result = client.change(name, value)
        assert isinstance(result, BoardSetting), result
        changed[name] = client.value(name)
    assert client.save() is None
    after = client.current()
    assert isinstance(after, SettingTable)
    world.power_off()
    world.run(1)
    world.power_on()
    found(world)
    again = client.current()
    assert isinstance(again, SettingTable)
    assert {name: again.settings[name].value for name in changed} == changed
    assert values(again) == values(after)
    kept = ", ".join(f"{name} {shown(value)}" for name, value in changed.items())
    figure("set, saved, and read after a power cycle", kept)


def values(table: SettingTable) -> dict[str, Value]:
    return {setting.name: setting.value for setting in table}


def test_every_setting_refuses_values_out_of_range_and_accepts_its_own(world: World) -> None:
    client = SettingsClient(world)
    table = client.wait_read()
    for setting in table:
        for value in (setting.minimum - 1, setting.maximum + 1):
            result = client.change(setting.name, value)
            assert isinstance(result, SettingRefusal)
            assert result.cause in (Cause.OUT_OF_RANGE, Cause.FIXED)
        result = client.change(setting.name, setting.value)
        assert isinstance(result, BoardSetting)
    after = client.current()
    assert isinstance(after, SettingTable)
    assert values(after) == values(table)


def test_armed_every_change_and_the_save_are_refused_without_a_request(world: World, figure: Figure) -> None:
    client = SettingsClient(world)
    table = client.wait_read()
    world.naze.faults.armed = True
    world.wait_until(lambda w: w.naze.armed and w.bridge.vehicle.armed is True, _STICKS_S)
    since = world.now
    for setting in table:
        result = client.change(setting.name, setting.maximum)
        assert isinstance(result, SettingRefusal)
        assert result.cause is Cause.ARMED
    saved = client.save()
    assert saved is not None
    assert saved.cause is Cause.ARMED
    world.run(2)
    requests = [
        frame
        for at, _, data in world.written
        if at >= since
        for frame in MspParser().feed(data)
        if frame.direction is Direction.REQUEST
    ]
    assert not _CHANGES & {frame.command for frame in requests}
    assert world.naze.armed
    figure("armed: changes refused by the bridge", len(table))


def test_a_board_that_has_armed_unnoticed_refuses_the_change(world: World) -> None:
    """The bridge asks STATUS right before the change, and the board itself refuses it."""
    client = SettingsClient(world)
    client.wait_read()
    world.naze.faults.armed = True
    world.run_until(lambda w: w.naze.armed, _STICKS_S)
    result = client.change("p_roll", 44)
    assert isinstance(result, SettingRefusal)
    assert world.naze.armed
