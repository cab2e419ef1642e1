# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --image`: the emulated board, on a bench or in a simulated sky."""

import asyncio
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from protocols.firmware_image import FLASH_SIZE, ImageError
from simulator.board.memory_file import open_memory
from simulator.board.options import Faults
from simulator.commands.run_board import RunOptions, run_board
from simulator.emulated_naze.image import Image, load_image
from simulator.emulated_naze.switches import EmulatedFaults
from simulator.sky.sky import Weather

if TYPE_CHECKING:
    from simulator.emulated_naze.board import EmulatedNaze

#: A computer that falls further behind gets a slower board.
_LONGEST_STEP_S = 0.005


def read_image(path: Path) -> Image:
    """An image that can be run here. click.ClickException."""
    try:
        from simulator.emulated_naze.native_chip import NativeChipError, load_native_chip

        load_native_chip()
    except ImportError as error:  # Unicorn is optional
        raise click.ClickException(
            "--image needs the Python package unicorn, which the Debian package lacks: see docs/howto/try-a-mission.md"
        ) from error
    except NativeChipError as error:
        raise click.ClickException(str(error)) from error
    try:
        return load_image(path.read_bytes(), str(path))
    except (ImageError, OSError) as error:
        raise click.ClickException(f"the image cannot be run: {error}") from error


def run_image(
    path: Path,
    faults: Faults,
    run_options: RunOptions,
    state: Path | None,
    seed: int,
    weather: Weather | None = None,
    tempo: float = 1.0,
) -> None:
    """Run a firmware until Ctrl-C. With `weather` in a craft that flies, at `tempo`. click.ClickException."""
    image = read_image(path)
    flash = open_memory(state, b"\xff" * FLASH_SIZE, "name another file") if state else None
    board = _flying(image, flash, weather, tempo) if weather else _on_bench(image, flash, faults, seed)
    board.faults.armed = faults.armed
    begun = time.monotonic()

    def say(done: float) -> None:
        end = f" {time.monotonic() - begun:.1f} s\n" if done == 1 else ""
        click.echo(f"\r{path.name} boots on the emulated board: {done:.0%}{end}", nl=False)

    board.on_boot = say
    asyncio.run(run_board(board, f"Naze with {path.name}", run_options, lambda: True))


def _on_bench(image: Image, flash: memoryview | None, faults: Faults, seed: int) -> "EmulatedNaze":
    from simulator.emulated_naze.board import EmulatedNaze

    switches = EmulatedFaults(bit_error_rate=faults.bit_error_rate, lost_byte_rate=faults.lost_byte_rate)
    return EmulatedNaze(image, switches, flash, seed=seed, longest_step_s=_LONGEST_STEP_S)


def _flying(image: Image, flash: memoryview | None, weather: Weather, tempo: float) -> "EmulatedNaze":
    """A flash without settings is prepared first."""
    from simulator.emulated_naze.console import ConsoleError
    from simulator.emulated_naze.flying_naze import FlyingNaze
    from simulator.emulated_naze.prepared_flash import prepared_flash

    if flash is None or flash[len(image.program) :] == b"\xff" * (FLASH_SIZE - len(image.program)):
        try:
            prepared = prepared_flash(image, click.echo)
        except ConsoleError as error:
            raise click.ClickException(f"this image does not fly: {error}") from error
        flash = memoryview(bytearray(FLASH_SIZE)) if flash is None else flash
        flash[:] = prepared
    return FlyingNaze(image, flash, weather=weather, longest_step_s=_LONGEST_STEP_S, tempo=tempo)
