# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --image`: the emulated board behind its plug."""

import asyncio
from pathlib import Path

import click

from simulator.board.memory_file import open_memory
from simulator.board.options import Faults
from simulator.commands.run_board import Running, run_board
from simulator.emulated_naze.image import FLASH_SIZE, ImageError, load_image
from simulator.emulated_naze.switches import EmulatedFaults

#: A computer that falls further behind gets a slower board.
_LONGEST_STEP_S = 0.005


def run_image(path: Path, faults: Faults, running: Running, state: Path | None, seed: int) -> None:
    """Run a firmware until Ctrl-C. click.ClickException."""
    try:
        from simulator.emulated_naze.board import EmulatedNaze  # Unicorn is optional
    except ImportError as error:
        raise click.ClickException(
            "--image needs the emulator: pip install 'naze-bridge[emulator]' (or the package unicorn)"
        ) from error
    try:
        image = load_image(path)
    except (ImageError, OSError) as error:
        raise click.ClickException(f"the image cannot be run: {error}") from error
    blank = b"\xff" * FLASH_SIZE
    flash = open_memory(state, blank, "name another file") if state else None
    switches = EmulatedFaults(
        armed=faults.armed, bit_error_rate=faults.bit_error_rate, lost_byte_rate=faults.lost_byte_rate
    )
    board = EmulatedNaze(image, switches, flash, seed=seed, longest_step_s=_LONGEST_STEP_S)
    asyncio.run(run_board(board, f"Naze with {path.name}", running, lambda: True))
