# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim`: a simulated flight controller on a pseudo-terminal or a TCP socket."""

import asyncio
from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

from simulator.board.flash import ERASED
from simulator.board.memory_file import open_memory
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults, SimOptions, TelemetryProtocol, Tree
from simulator.commands.fc_kinds import KINDS, run_other_board
from simulator.commands.image import run_image
from simulator.commands.run_board import RunOptions, run_board
from simulator.commands.stick_script import read_script
from simulator.inav.boxes import BOXES
from simulator.naze.board import SimulatedNaze
from simulator.naze.compiled_core import CORE_CAPACITY, load_core
from simulator.naze.mission_commands import MissionCommands
from simulator.naze.mission_slots import flash_size
from simulator.naze.missions import BootMissions
from simulator.sky.sky import Weather

_BAUD = click.Choice(["1200", "2400", "4800", "9600", "19200", "38400", "57600", "115200"])
_RATE = click.FloatRange(0, 1)
_PERIOD = click.FloatRange(0)
_PATH = click.Path(path_type=Path)


def _load_core(path: Path, capacity: int) -> BootMissions:
    if capacity != CORE_CAPACITY:
        raise click.ClickException(f"the compiled core holds {CORE_CAPACITY} records: omit --capacity")
    try:
        return load_core(path)
    except OSError as error:
        raise click.ClickException(f"the core cannot be loaded: {error}; make it with: make -C firmware sim") from error


#: The options that --image allows: the rest depends on the firmware.
_WITH_IMAGE = {
    "image", "link", "tcp", "armed", "bit_errors", "lost_bytes", "seed", "hang_after", "power_cut_after", "state",
    "control", "fly", "wind", "script", "speed",
}  # fmt: skip
#: Options of a flight.
_WITH_FLY = {"wind", "script", "speed"}
#: Options of Harakiri and the mission extension, and of --image.
_OF_THE_NAZE = {
    "tele_prot", "no_extension", "flash_stall", "program_stall", "wp_radius_cm", "core", "speed",
}  # fmt: skip


def _refuse_options(mode: str, is_refused: Callable[[str], bool]) -> None:
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        if is_refused(name) and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{parameter.opts[0]} has no effect with {mode}: omit it")


def _address(_: click.Context, __: click.Parameter, value: str | None) -> tuple[str, int] | None:
    if value is None:
        return None
    host, _colon, port = value.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise click.BadParameter(f"{value!r} is not HOST:PORT, for instance 127.0.0.1:5760")
    return host, int(port)


@click.command()
@click.option("--kind", type=click.Choice(["naze", *KINDS]), default="naze", help="The flight controller to simulate.")
@click.option(
    "--inav-version", type=click.Choice(list(BOXES)), default="9.1.0", help="Version of INAV, with --kind inav."
)
@click.option("--link", type=_PATH, help="Symbolic link to make to the port.")
@click.option("--tcp", metavar="HOST:PORT", callback=_address, help="Listen on TCP instead, for one client at a time.")
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
@click.option("--boot", type=_PERIOD, default=SimOptions().boot_ms, show_default=True, help="Time to boot, ms.")
@click.option(
    "--tree",
    type=click.Choice([tree.name.lower() for tree in Tree]),
    default=SimOptions().tree.name.lower(),
    show_default=True,
    help="Harakiri's source tree.",
)
@click.option("--capacity", type=click.IntRange(2, 1000), help="Records that fit: 146 on a Naze, 178 on a MultiWii.")
@click.option(
    "--wp-radius-cm", type=click.IntRange(0, 2000), default=200, show_default=True, help="gps_wp_radius, if blank."
)
@click.option("--seed", type=int, default=0, help="Seed of the random faults.")
@click.option("--hang-after", type=_PERIOD, help="Stop answering after this many seconds.")
@click.option("--power-cut-after", type=_PERIOD, help="Lose power after this many seconds.")
@click.option(
    "--core",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Run the firmware's own mission core from this shared library (make -C firmware sim).",
)
@click.option(
    "--image",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Emulate the chip and run this firmware (.elf, .hex or .bin). Needs Unicorn.",
)
@click.option("--fly", is_flag=True, help="With --image: put the board into a quadcopter that flies.")
@click.option(
    "--wind", type=click.FloatRange(0, 20), default=0.0, help="With --fly: wind from the west, m/s, with gusts."
)
@click.option(
    "--script",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="With --fly: sticks and switches, lines of SECONDS NAME VALUE (docs/simulator.md).",
)
@click.option("--state", "--flash", "state", type=_PATH, help="File that keeps the flash's contents.")
@click.option("--control", type=_PATH, help="Unix socket for control commands (docs/simulator.md).")
@click.option(
    "--speed",
    type=click.FloatRange(0.01, 100),
    default=1.0,
    help="With --fly: 10 is ten times as fast, or as fast as the computer can.",
)
def sim(
    kind: str,
    inav_version: str,
    link: Path | None,
    tcp: tuple[str, int] | None,
    baud: str,
    armed: bool,
    tele_prot: int,
    no_extension: bool,
    bit_errors: float,
    lost_bytes: float,
    flash_stall: float,
    program_stall: float,
    boot: float,
    tree: str,
    capacity: int | None,
    wp_radius_cm: int,
    seed: int,
    hang_after: float | None,
    power_cut_after: float | None,
    core: Path | None,
    image: Path | None,
    fly: bool,
    wind: float,
    script: Path | None,
    state: Path | None,
    control: Path | None,
    speed: float,
) -> None:
    """Simulate a Naze with Harakiri, or another flight controller, until Ctrl-C."""
    if (link is None) == (tcp is None):
        raise click.UsageError("specify the connection: --link PATH or --tcp HOST:PORT")
    faults = Faults(armed=armed, extension=not no_extension, bit_error_rate=bit_errors, lost_byte_rate=lost_bytes)
    moves = tuple((at_s / speed, line) for at_s, line in read_script(script)) if script else ()
    run_options = RunOptions(link, tcp, control, hang_after, power_cut_after, moves)
    if fly and image is None:
        raise click.UsageError("--fly needs a firmware: add --image FILE")
    if not fly:
        _refuse_options("a board that does not fly", lambda name: name in _WITH_FLY)
    if image is not None:
        _refuse_options("--image", lambda name: name not in _WITH_IMAGE)
        run_image(image, faults, run_options, state, seed, Weather(wind=wind, seed=seed) if fly else None, speed)
        return
    if kind != "naze":
        _refuse_options(f"--kind {kind}", lambda name: name in _OF_THE_NAZE)
        line = MspOptions(version=inav_version, baud=int(baud), capacity=capacity or 178, seed=seed)
        run_other_board(kind, line, faults, run_options, state)
        return
    options = SimOptions(
        seed=seed,
        baud=int(baud),
        tele_prot=TelemetryProtocol(tele_prot),
        boot_ms=boot,
        tree=Tree[tree.upper()],
        capacity=capacity or 146,
        wp_radius_cm=wp_radius_cm,
        flash_erase_ms=flash_stall,
        record_program_ms=program_stall,
    )
    blank = bytes((ERASED,)) * flash_size(options)
    memory = open_memory(state, blank, "use the same --capacity as before, or another file") if state else None
    missions = _load_core(core, options.capacity) if core else MissionCommands
    naze = SimulatedNaze(options, faults, memory, missions)
    asyncio.run(run_board(naze, "Naze", run_options, lambda: True))
