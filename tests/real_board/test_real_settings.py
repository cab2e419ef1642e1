# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings on the image: a change in the firmware's memory is reported by name, and nothing else is."""

import pytest

from simulator.emulated_naze.board import EmulatedNaze
from simulator.emulated_naze.image import Image
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


def read_again(world: World) -> None:
    SettingsClient(world).current()
    world.run(_READING_S)


def test_a_pid_changed_in_memory_is_reported(world: World, image: Image, figure: Figure) -> None:
    settings = world.inside.board_settings
    world.wait_until(lambda _: settings.known.state is not None, 30)
    assert settings.known.state is not None
    seal = settings.known.state.seal
    read_again(world)
    assert settings.known.state.seal == seal
    assert world.events("settings.changed_on_board") == []
    assert settings.known.table is not None
    p_roll, p_pitch = (int(settings.known.table.settings[name].value) for name in ("p_roll", "p_pitch"))
    cfg = image.symbols["cfg"]
    p_values = cfg + bytes(world.naze.peek(cfg, _CFG_SIZE)).index(bytes((p_roll, p_pitch)))
    world.naze.poke(p_values + 1, bytes((p_pitch + 5,)))
    read_again(world)
    (event,) = world.events("settings.changed_on_board")
    assert event.facts["detail"] == "Settings changed elsewhere: p_pitch"
    figure("a PID poked into memory: seal before, after", f"{seal}, {event.facts['seal']}")
    read_again(world)
    assert len(world.events("settings.changed_on_board")) == 1
    assert world.naze.counters.hazard_runs == 0
