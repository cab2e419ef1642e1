"""`naze-bridge sim`: the simulated Naze alone, behind a link that looks like a serial port."""

import asyncio
import mmap
import signal
from pathlib import Path

import click

from service.simulator.compiled_core import CORE_CAPACITY, load_core
from service.simulator.control import Control
from service.simulator.flash import ERASED
from service.simulator.mission_commands import MissionCommands
from service.simulator.mission_slots import flash_size
from service.simulator.missions import BootMissions
from service.simulator.naze import SimulatedNaze
from service.simulator.options import Faults, SimOptions, TelemetryProtocol
from service.simulator.playback_command import play_capture
from service.simulator.pty_link import PlugError, PtyLink

_BAUD = click.Choice(["1200", "2400", "4800", "9600", "19200", "38400", "57600", "115200"])
_RATE = click.FloatRange(0, 1)
_PERIOD = click.FloatRange(0)
_PATH = click.Path(path_type=Path)


def _open_flash(path: Path, size: int) -> memoryview:
    """Map the file that holds the flash; a new one is blank."""
    try:
        if not path.exists():
            path.write_bytes(bytes((ERASED,)) * size)
        with path.open("r+b") as file:
            found = path.stat().st_size
            if found == size:
                return memoryview(mmap.mmap(file.fileno(), size))
    except OSError as error:
        raise click.ClickException(f"Cannot use the state file {path}: {error.strerror}.") from error
    raise click.ClickException(
        f"The state file {path} has {found} bytes, but this board's flash has {size}: "
        "give the same --capacity as before, or another file."
    )


def _load_core(path: Path, capacity: int) -> BootMissions:
    if capacity != CORE_CAPACITY:
        raise click.ClickException(f"The compiled core holds {CORE_CAPACITY} records: leave --capacity away.")
    try:
        return load_core(path)
    except OSError as error:
        raise click.ClickException(f"Cannot load the core: {error}. Make it with: make -C firmware sim") from error


async def _run(
    naze: SimulatedNaze, path: Path, control: Path | None, hang_after: float | None, power_cut_after: float | None
) -> None:
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    naze.power_on_booted(loop.time())
    link = PtyLink(naze, path, loop)
    obedience = Control(naze, link, loop)
    if hang_after is not None:
        loop.call_later(hang_after, obedience.obey, "hang 1")
    if power_cut_after is not None:
        loop.call_later(power_cut_after, obedience.obey, "power off")
    try:
        link.plug()
        if control:
            await obedience.listen(control)
        click.echo(f"Simulated Naze at {path}, {naze.baud} baud. Ctrl-C ends it.")
        await stop.wait()
    except PlugError as error:
        raise click.ClickException(f"{error}.") from error
    except OSError as error:
        raise click.ClickException(f"Cannot make {control}: {error.strerror}.") from error
    finally:
        link.unplug()
        obedience.close()


@click.command()
@click.option("--link", required=True, type=_PATH, help="Symbolic link to make to the port.")
@click.option("--baud", type=_BAUD, default="115200", show_default=True, help="Speed while disarmed.")
@click.option("--armed", is_flag=True, help="Begin armed.")
@click.option(
    "--tele-prot",
    type=click.IntRange(0, 3),
    default=0,
    help="While armed: 0 MSP, 1 FrSky at 9600, 2 MAVLink, 3 MAVLink at 57600.",
)
@click.option("--no-extension", is_flag=True, help="Stock firmware, without the mission extension.")
@click.option("--bit-errors", type=_RATE, default=0.0, help="Probability that a bit is flipped.")
@click.option("--lost-bytes", type=_RATE, default=0.0, help="Probability that a byte is lost.")
@click.option("--flash-stall", type=_PERIOD, default=100.0, show_default=True, help="Time to erase a slot, ms.")
@click.option("--program-stall", type=_PERIOD, default=0.45, show_default=True, help="Time to program a record, ms.")
@click.option("--capacity", type=click.IntRange(2, 1000), default=146, show_default=True, help="Records that fit.")
@click.option(
    "--wp-radius-cm", type=click.IntRange(0, 2000), default=200, show_default=True, help="gps_wp_radius, if blank."
)
@click.option("--seed", type=int, default=0, help="Of the random faults.")
@click.option("--hang-after", type=_PERIOD, help="Stop answering after this many seconds.")
@click.option("--power-cut-after", type=_PERIOD, help="Lose power after this many seconds.")
@click.option(
    "--core",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Run the firmware's own mission core out of this shared library (make -C firmware sim).",
)
@click.option("--state", type=_PATH, help="File that keeps the flash's contents.")
@click.option("--control", type=_PATH, help="Unix socket that takes lines from tests.")
@click.option(
    "--play",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Play this UART capture (run --record-uart) instead.",
)
@click.option("--speed", type=click.FloatRange(0.01, 100), default=1.0, help="How many times as fast to play it.")
def sim(
    link: Path,
    baud: str,
    armed: bool,
    tele_prot: int,
    no_extension: bool,
    bit_errors: float,
    lost_bytes: float,
    flash_stall: float,
    program_stall: float,
    capacity: int,
    wp_radius_cm: int,
    seed: int,
    hang_after: float | None,
    power_cut_after: float | None,
    core: Path | None,
    state: Path | None,
    control: Path | None,
    play: Path | None,
    speed: float,
) -> None:
    """Simulate a Naze with Harakiri, on a pseudo-terminal, until Ctrl-C."""
    if play is not None:
        play_capture(play, link, speed)
        return
    options = SimOptions(
        seed=seed,
        baud=int(baud),
        tele_prot=TelemetryProtocol(tele_prot),
        capacity=capacity,
        wp_radius_cm=wp_radius_cm,
        flash_erase_ms=flash_stall,
        record_program_ms=program_stall,
    )
    faults = Faults(armed=armed, extension=not no_extension, bit_error_rate=bit_errors, lost_byte_rate=lost_bytes)
    memory = _open_flash(state, flash_size(options)) if state else None
    missions = _load_core(core, capacity) if core else MissionCommands
    naze = SimulatedNaze(options, faults, memory, missions)
    asyncio.run(_run(naze, link, control, hang_after, power_cut_after))
