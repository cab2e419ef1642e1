# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --kind`: an MSP flight controller other than the Naze."""

import asyncio
from dataclasses import replace
from pathlib import Path

from simulator.board.memory_file import open_memory
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board, new_eeprom
from simulator.commands.run_board import Running, run_board

_NAMES = {"inav": "INAV", "multiwii": "MultiWii", "betaflight": "Betaflight", "baseflight": "baseflight"}


def run_other_board(kind: str, options: MspOptions, faults: Faults, running: Running, state: Path | None) -> None:
    """Run one until Ctrl-C. `state`: the file with its EEPROM."""
    if running.tcp:
        # A socket is served at once, with the ring of INAV's own simulator.
        options = replace(options, baud=None, ring_size=2048, serial_task_ms=0.01)
    eeprom = open_memory(state, bytes(new_eeprom(kind, options)), "name another file") if state else None
    board = make_board(kind, options, faults, eeprom)
    name = f"INAV {options.version}" if kind == "inav" else _NAMES[kind]
    asyncio.run(run_board(board, name, running, lambda: board.is_alive))
