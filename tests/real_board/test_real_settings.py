# SPDX-License-Identifier: GPL-3.0-or-later
"""The seal of the settings on the image: a change in the firmware's memory is reported by name, and nothing else is."""

import pytest

from protocols.firmware_image import Image
from protocols.msp.setting_table import encode_set_setting
from protocols.msp.settings import Part
from simulator.emulated_naze.board import EmulatedNaze
from tests.support.real_bench import Figure
from tests.support.settings_client import SettingsClient
from tests.support.world import World

_CFG_SIZE = 3 * 1024
_READING_S = 2.0


@pytest.fixture
def world(image: Image, flash: bytes) -> World:
    world = World(speeds=(115200,), peer=EmulatedNaze(image, flash=memoryview(bytearray(flash))))
    world.wait_ready()
    return world


def test_a_pid_changed_in_memory_is_reported(world: World, image: Image, figure: Figure) -> None:
    settings = world.inside.seal
    world.wait_until(lambda _: settings.state is not None, 30)
    assert settings.state is not None
    seal = settings.state.seal
    assert set(seal.parts) == set(Part)
    settings.due = world.now  # not after a minute: the emulator is slow
    world.run(_READING_S)
    assert settings.state.seal == seal
    assert world.events("settings.changed_on_board") == []
    pids = seal.parts[Part.PIDS]
    cfg = image.symbols["cfg"]
    p_values = cfg + bytes(world.naze.peek(cfg, _CFG_SIZE)).index(pids[::3])
    world.naze.poke(p_values + 1, bytes((pids[3] + 5,)))
    settings.due = world.now
    world.run(_READING_S)
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: PIDs PITCH"
    figure("a PID poked into memory: seal before, after", f"{seal}, {event.facts['seal']}")
    world.run(_READING_S)
    assert len(world.events("settings.changed_on_board")) == 1
    assert world.naze.counters.hazard_runs == 0


def test_any_other_setting_changed_in_memory_is_reported_and_read(world: World, figure: Figure) -> None:
    settings, client = world.inside.seal, SettingsClient(world)
    table = client.wait_read()
    world.wait_until(lambda _: settings.state is not None, 30)
    index, handle = list(table.settings).index("nav_speed_max"), table.settings["nav_speed_max"].handle
    world.naze.receive(encode_set_setting(index, handle, 777), world.now)
    world.run(1)
    settings.due = world.now
    world.run(_READING_S)
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: other settings"
    world.wait_until(lambda _: client.value("nav_speed_max") == 777, 10)
    figure("nav_speed_max set without the bridge", "reported, and read by the bridge")
