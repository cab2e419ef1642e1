# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's own parameters over MAVLink on the image, patched or not, and the bridge that shows them."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.harakiri.mavlink_settings import HarakiriMavlinkSettings
from bridge.fc.fc_settings import SettingRefusal
from bridge.model.settings import SettingTable
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkSplitter
from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
from tests.support import mavlink_parameters as page
from tests.support.packing import pack
from tests.support.real_bench import Figure, RealBench
from tests.support.settings_client import SettingsClient
from tests.support.world import GroundStation, World

_BOOT_S = 30.0
_LIST_S = 30.0
_HEARTBEAT = pack(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))


@pytest.fixture
def world(image: Image, flash: bytes) -> World:
    """Another MAVLink device on the port keeps the board from MSP."""
    world = World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    writer = FrameWriter(7, 1)

    def beat() -> None:
        world.naze.receive(writer.frame(_HEARTBEAT, 1), world.now)
        world.after(1.0, beat)

    beat()
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK and w.bridge.vehicle.armed is False, _BOOT_S)
    return world


def configuration(world: World, image: Image) -> bytes:
    at = image.symbols["cfg"]
    size = min(address for address in image.symbols.values() if address > at) - at
    return bytes(world.naze.peek(at, size))


def test_a_set_also_changes_the_setting_whose_name_it_begins_with(bench: RealBench, figure: Figure) -> None:
    page.a_set_also_changes_the_setting_whose_name_it_begins_with(bench)
    figure("PARAM_SET rc_dbyw", "changes rc_db, too")


def test_the_bridge_shows_all_of_them_and_changes_nothing(
    world: World, image: Image, bench: RealBench, figure: Figure
) -> None:
    station = GroundStation(world)
    station.stay_connected()
    station.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTRA1, 50, 1))
    world.run(10)
    usual = attitudes_per_s(world, station)
    before, flash_operations = configuration(world, image), world.naze.flash_operations
    station.take()
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(4)
    beside = attitudes_per_s(world, station)
    began = world.now - 14
    table = SettingsClient(world).wait_read(_LIST_S)
    took_s = world.now - began
    world.run(5)
    values = station.messages("PARAM_VALUE")
    count = max(value.param_count for value in values)
    assert len({value.param_id for value in values if value.param_count == count}) == count
    assert table.is_complete
    figure("settings over its own MAVLink; parameters; s", f"{len(table)}; {count}; {took_s:.1f}")
    figure("ATTITUDE a second, without and beside the list", f"{usual:.1f}, {beside:.1f}")
    assert beside >= 0.8 * usual
    assert configuration(world, image) == before
    assert world.naze.flash_operations == flash_operations
    assert_same_as_command_line(table, bench)
    for name, value in (("p_roll", 77), ("gbl_flg", 3), ("align_mag_x", 1)):
        result = SettingsClient(world).change(name, value)
        assert isinstance(result, SettingRefusal)
        assert HarakiriMavlinkSettings.read_only in result.text
    world.run(3)
    assert configuration(world, image) == before
    sent = {frame.msgid for _, _, data in world.written for frame in MavlinkSplitter().feed(data)}
    assert m.MAVLINK_MSG_ID_PARAM_SET not in sent
    assert world.naze.counters.hazard_runs == 0


def attitudes_per_s(world: World, station: GroundStation) -> float:
    before = len(station.messages("ATTITUDE"))
    world.run(10)
    return (len(station.messages("ATTITUDE")) - before) / 10


def assert_same_as_command_line(table: SettingTable, bench: RealBench) -> None:
    bench.enter_cli()
    bench.send(b"set *\r")
    shown = bench.run(8.0).decode("latin-1")
    held = dict(line.strip().split(" = ") for line in shown.splitlines() if " = " in line)
    held = {name: words.split()[0] for name, words in held.items()}
    assert held.keys() == table.settings.keys()
    for setting in table:
        assert float(setting.value) == pytest.approx(float(held[setting.name]), abs=1e-3), setting.name
