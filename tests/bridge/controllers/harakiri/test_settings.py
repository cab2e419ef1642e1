# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from bridge.fc.fc_settings import Cause
from protocols.msp.setting_table import HeldSetting, SettingCommand, table_checksum
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.setting_table import SETTINGS as NAZE_SETTINGS
from tests.support.seeds import seeds
from tests.support.settings_client import BOARDS, SettingsClient, asked, cause_of, ready, value_of
from tests.support.world import World


def test_the_list_takes_less_than_two_seconds_and_is_then_cached() -> None:
    world = World(speeds=(115200,))
    world.wait_until(lambda world: world.is_found, 20)
    began = world.now
    client = SettingsClient(world)
    client.wait_read()
    assert world.now - began < 2.0
    world.run(5)
    since = world.now
    assert client.current() is not None
    assert asked(world, SettingCommand.SETTING, since) == 1
    world.assert_line_was_clean()


def test_a_change_with_side_effects_is_read_back_completely() -> None:
    """Another accelerometer makes the calibration of the first one void."""
    world, client = ready(BOARDS["patched Harakiri"])
    assert value_of(client.change("rc_trm_rll", 12.5)) == 12.5
    client.change("acc_hdw", 1)
    world.run(10)
    assert client.value("rc_trm_rll") == 0.0
    assert world.events("settings.changed_on_board") == []


@pytest.mark.parametrize("seed", seeds(2))
def test_a_bad_line_yields_the_right_table_or_none(seed: int) -> None:
    world = World(faults=Faults(bit_error_rate=1e-4), speeds=(115200,), seed=seed)
    table = SettingsClient(world).wait_read(120)
    held = [
        HeldSetting(setting.handle.setting, float(setting.value)) for setting in table if "BOX_" not in setting.name
    ]
    assert table_checksum(held) == table_checksum(NAZE_SETTINGS)


def test_an_armed_harakiri_in_mavlink_mode_keeps_the_table() -> None:
    faults = Faults()
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), faults, speeds=(115200,))
    client = SettingsClient(world)
    table = client.wait_read()
    world.arm(20, then_s=5)
    assert client.current() is table
    assert cause_of(client.change("p_roll", 40)) is Cause.ARMED
    faults.armed = False
    world.wait_until(lambda world: world.bridge.vehicle.armed is False, 20, then_s=10)
    assert value_of(client.change("p_roll", 40)) == 40
