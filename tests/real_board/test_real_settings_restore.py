# SPDX-License-Identifier: GPL-3.0-or-later
"""Backup, change, save, and restore onto a blank board: the image's own table is equal afterwards."""

import pytest

from bridge.model.settings import SettingTable, Value, ValueKind
from bridge.settings.local_settings import RestoreResult
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support.real_bench import Figure
from tests.support.settings_client import SettingsClient, value_of
from tests.support.world import World

#: Settings that change neither the port nor the sensors nor the pulse of disarmed motors.
_TUNED = ("p_", "i_", "d_", "nav_", "rtl_", "snr_m", "gps_ph", "gps_pos", "gt_", "as_", "rc_db")
#: The firmware sets these to 0 whenever it loads its settings (navigation.c, GPS_set_pids).
_ALWAYS_0 = ("gps_pos_d", "gps_posr_i")
_BLANK = b"\xff" * 0x2_0000


def world_of(image: Image, flash: bytes) -> tuple[World, SettingsClient]:
    world = World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    world.wait_ready()
    world.wait_until(lambda world: world.bridge.settings.is_checked and bool(world.backups), 60)
    return world, SettingsClient(world)


def values(table: SettingTable) -> dict[str, Value]:
    return {setting.name: setting.value for setting in table}


@pytest.mark.timeout(3600)
def test_a_backup_is_restored_onto_a_blank_board(image: Image, flash: bytes, figure: Figure) -> None:
    world, client = world_of(image, flash)
    met = values(client.wait_read())
    assert world.backups[0].values == met
    changed = 0
    for setting in client.wait_read():
        is_free = setting.kind is ValueKind.INTEGER and not setting.fixed and float(setting.value) < setting.maximum
        if is_free and setting.name.startswith(_TUNED) and setting.name not in _ALWAYS_0:
            value_of(client.change(setting.name, float(setting.value) + 1))
            changed += 1
    assert client.save() is None
    world.wait_until(lambda world: world.backups[-1].occasion.value == "saved", 30)
    backup = world.backups[-1]
    assert sum(backup.values[name] != met[name] for name in met) == changed

    blank, fresh = world_of(image, _BLANK)
    began = blank.now
    results: list[object] = []
    blank.bridge.settings.restore(
        backup.values, backup.board.kind, "test", lambda _count: None, lambda each, _at: results.append(each), blank.now
    )
    blank.wait_until(lambda _: bool(results), 120)
    (result,) = results
    assert isinstance(result, RestoreResult), result
    assert result.is_saved, result.text
    took = blank.now - began
    blank.power_off()
    blank.run(3)
    blank.power_on()
    blank.wait_until(lambda world: not world.is_found, 10)
    blank.wait_until(lambda world: world.is_found, 60)
    blank.wait_until(lambda world: world.bridge.settings.is_checked, 60)
    left_out = {each.name for each in result.left_out}
    held = values(fresh.wait_read())
    assert {name for name in held if held[name] != backup.values.get(name)} <= left_out
    figure("settings restored onto a blank board, left out", f"{len(result.changed)}, {sorted(left_out)}")
    figure("time on the board, s", f"{took:.1f}")
