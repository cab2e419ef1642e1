# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --kind`: the simulated boards other than the Naze."""

import asyncio
from dataclasses import replace
from functools import partial
from pathlib import Path

from simulator.board.memory_file import open_memory
from simulator.board.msp_board import MspBoard
from simulator.board.msp_firmware import BootFirmware
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.board.telemetry_only import BASEFLIGHT, BETAFLIGHT, TelemetryFirmware
from simulator.commands.run_board import RunOptions, run_board
from simulator.inav.firmware import InavFirmware
from simulator.inav.mission import EEPROM_SIZE
from simulator.inav.places import PLACES_SIZE
from simulator.inav.settings import SETTINGS_SIZE
from simulator.multiwii.firmware import MultiWiiFirmware
from simulator.multiwii.mission import blank_eeprom

_FIRMWARE: dict[str, BootFirmware] = {
    "inav": InavFirmware,
    "multiwii": MultiWiiFirmware,
    "betaflight": partial(TelemetryFirmware, BETAFLIGHT),
    "baseflight": partial(TelemetryFirmware, BASEFLIGHT),
}
KINDS = tuple(_FIRMWARE)
_NAMES = {"inav": "INAV", "multiwii": "MultiWii", "betaflight": "Betaflight", "baseflight": "baseflight"}


def new_eeprom(kind: str, options: MspOptions) -> bytearray:
    """The EEPROM of a factory-new board."""
    inav_size = EEPROM_SIZE + SETTINGS_SIZE + PLACES_SIZE
    return blank_eeprom(options.capacity) if kind == "multiwii" else bytearray(inav_size)


def make_board(
    kind: str, options: MspOptions | None = None, faults: Faults | None = None, eeprom: memoryview | None = None
) -> MspBoard:
    """Create a board without power. `eeprom` outlives the board, or None if a blank one."""
    options = options or MspOptions()
    if eeprom is None:
        eeprom = memoryview(new_eeprom(kind, options))
    return MspBoard(_FIRMWARE[kind], eeprom, options, faults)


def run_other_board(
    kind: str, options: MspOptions, faults: Faults, run_options: RunOptions, state: Path | None
) -> None:
    """Run a board of this kind until Ctrl-C. `state`: the file with its EEPROM."""
    if run_options.tcp:
        # A socket is served at once, with the ring of INAV's own simulator.
        options = replace(options, baud=None, ring_size=2048, serial_task_ms=0.01)
    eeprom = open_memory(state, bytes(new_eeprom(kind, options)), "name another file") if state else None
    board = make_board(kind, options, faults, eeprom)
    name = f"INAV {options.version}" if kind == "inav" else _NAMES[kind]
    asyncio.run(run_board(board, name, run_options, lambda: board.is_alive))
