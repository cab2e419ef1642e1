# SPDX-License-Identifier: GPL-3.0-or-later
"""A backup is taken when a board is met, when its settings were saved, and when they changed without the bridge."""

from simulator.board.options import Faults, SimOptions
from tests.bridge.settings.test_board_settings import restart
from tests.support.inside import inside
from tests.support.settings_client import BOARDS, ready, value_of
from tests.support.world import World

NAZE = "patched Harakiri"


def occasions(world: World) -> list[str]:
    return [backup.occasion.value for backup in world.backups]


def test_a_board_that_is_met_is_backed_up_whole() -> None:
    world, client = ready(BOARDS[NAZE])
    world.wait_until(lambda world: bool(world.backups), 20)
    (backup,) = world.backups
    assert backup.board.kind.startswith("Harakiri")
    assert backup.values == {setting.name: setting.value for setting in client.wait_read()}


def test_changes_are_backed_up_only_once_they_are_saved() -> None:
    world, client = ready(BOARDS[NAZE])
    world.wait_until(lambda world: bool(world.backups), 20)
    value_of(client.change("p_roll", 44))
    inside(world.bridge).board_settings.may_have_changed(world.now)
    world.run(10)
    assert occasions(world) == ["connected"]
    assert client.save() is None
    world.run(5)
    assert occasions(world) == ["connected", "saved"]
    assert world.backups[-1].values["p_roll"] == 44


def test_unsaved_changes_that_a_restart_has_lost_no_longer_prevent_a_backup() -> None:
    world, client = ready(BOARDS[NAZE])
    world.wait_until(lambda world: bool(world.backups), 20)
    value_of(client.change("p_roll", 44))
    restart(world)
    world.run(10)
    assert occasions(world)[:2] == ["connected", "connected"]
    assert world.backups[-1].values == world.backups[0].values


def test_an_armed_board_is_backed_up_after_it_has_disarmed() -> None:
    faults = Faults(armed=True)
    world = World(SimOptions(), faults, speeds=(115200,))
    world.wait_until(lambda world: world.is_found, 20)
    world.run(20)
    assert world.backups == []
    faults.armed = False
    world.wait_until(lambda world: bool(world.backups), 30)
