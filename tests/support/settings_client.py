# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings' door of a simulated bridge, used as the command line does, and the boards that have settings."""

from collections.abc import Callable
from dataclasses import dataclass

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.model.settings import BoardSetting, SettingTable, Value
from bridge.settings.setting_work import Answer
from simulator.board.options import Faults, SimOptions
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import BOXES
from simulator.inav.setting_table import SETTINGS as INAV_SETTINGS
from simulator.naze.setting_table import SETTINGS as NAZE_SETTINGS
from tests.support.inside import inside
from tests.support.world import World


class SettingsClient:
    """Each call returns the result, after the time that it takes."""

    def __init__(self, world: World, name: str = "test") -> None:
        self._world, self._name = world, name
        self._settings = inside(world.bridge).board_settings

    @property
    def is_idle(self) -> bool:
        """True while no table is read."""
        return self._settings._reading is None

    def wait_read(self, seconds: float = 30) -> SettingTable:
        self._world.wait_until(lambda _: self._settings.known.table is not None, seconds)
        table = self._settings.known.table
        assert table is not None
        return table

    def value(self, name: str) -> Value:
        table = self._settings.known.table
        assert table is not None
        return table.settings[name].value

    def change(self, name: str, value: Value) -> BoardSetting | SettingRefusal:
        found: list[Answer] = []
        self._settings.change(name, value, lambda result, _at: found.append(result), self._world.now, self._name)
        self._world.wait_until(lambda _: bool(found), 20)
        (result,) = found
        return result if isinstance(result, SettingRefusal) else result[0]

    def save(self) -> SettingRefusal | None:
        found: list[Answer] = []
        self._settings.save(lambda result, _at: found.append(result), self._world.now)
        self._world.wait_until(lambda _: bool(found), 20)
        return found[0] if isinstance(found[0], SettingRefusal) else None

    def current(self) -> SettingTable | SettingRefusal:
        found: list[SettingTable | SettingRefusal] = []
        self._settings.current(lambda result, _at: found.append(result), self._world.now, 40)
        self._world.wait_until(lambda _: bool(found), 45)
        return found[0]


@dataclass(frozen=True)
class Board:
    """A simulated board, the number of its settings, and one of them with a value, another one and one out of range."""

    make: Callable[[Faults], World]
    count: int
    name: str
    before: Value
    after: Value
    outside: Value


def on(kind: str | None, options: SimOptions | None = None) -> Callable[[Faults], World]:
    def make(faults: Faults) -> World:
        peer = None if kind is None else make_board(kind, faults=faults)
        return World(options, faults, speeds=(115200,), peer=peer)

    return make


def unpatched(faults: Faults) -> World:
    faults.extension = False
    return on(None)(faults)


BOARDS = {
    "patched Harakiri": Board(on(None), len(NAZE_SETTINGS) + 15, "p_roll", 35, 36, 201),
    "Harakiri": Board(unpatched, 30 + 15 + 7, "YAW_P", 40, 36, 256),
    "INAV": Board(on("inav"), len(INAV_SETTINGS) + len(BOXES["9.1.0"]), "nav_rth_altitude", 1000, 1300, 65001),
    "MultiWii": Board(on("multiwii"), 59, "PITCH_P", 33, 40, 256),
    "Betaflight": Board(on("betaflight"), 52, "PITCH_D", 34, 35, 256),
    "baseflight": Board(on("baseflight"), 60, "RC_RATE", 90, 70, -1),
}


def ready(board: Board, faults: Faults | None = None) -> tuple[World, SettingsClient]:
    world = board.make(faults or Faults())
    world.wait_until(lambda world: world.is_found, 40)
    client = SettingsClient(world)
    client.wait_read()
    return world, client


def value_of(result: BoardSetting | SettingRefusal) -> Value:
    assert isinstance(result, BoardSetting), result
    return result.value


def cause_of(result: object) -> Cause:
    assert isinstance(result, SettingRefusal), result
    assert result.text
    assert "\n" not in result.text
    return result.cause


def asked(world: World, command: int, since: float = 0.0) -> int:
    frames = world.requests(since)
    return sum(frame.command == command for frame in frames)


def restart(world: World) -> None:
    world.power_off()
    world.run(5)
    world.power_on()
    world.wait_until(lambda world: world.is_found, 40)
    SettingsClient(world).current()
