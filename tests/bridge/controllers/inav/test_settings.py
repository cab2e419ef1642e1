# SPDX-License-Identifier: GPL-3.0-or-later
from protocols.mission_item import MissionResult
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
