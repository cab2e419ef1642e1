# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fly`: a mission file flown by a real firmware image in the simulated sky, and judged."""

from dataclasses import asdict
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click
from rich.table import Table

from bridge.controllers.table import PROFILES
from bridge.fc.profile import RuleSettings
from bridge.missions.list_check import check_list
from protocols.firmware_image import FLASH_SIZE, Image
from protocols.mission_file import MissionFileError
from protocols.msp.mission import WpRecord
from protocols.plain_text import FileError
from reports.verdict import Result
from service.settings import SettingsError, takeoff_limit_m
from simulator.commands.image import read_image
from simulator.sky.body import Airframe
from simulator.sky.earth import Place
from simulator.sky.lies import NAMES
from simulator.sky.sky import Weather
from terminal.files import read_file, shown_path, write_file
from terminal.mission_source import load_mission
from terminal.options import PATH
from terminal.printing import print_json, print_table
from terminal.sentences import fail, say

if TYPE_CHECKING:
    from simulator.flights.judgement import ItemResult
    from simulator.flights.mission_run import MissionRun
    from simulator.flights.wrongs import Wrongs

#: The only firmware that flies such a list.
_KIND = "harakiri"
_SETTINGS = ("set mission_fly=1",)


class FlyStatus(IntEnum):
    """The exit status."""

    FLOWN = 0
    NOT_FLOWN = 1
    UNUSABLE = 2


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--image", required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path), help="The firmware."
)
@click.option(
    "--flash",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="The board's flash (sim --flash) with your settings, which is not changed. Default: a prepared board.",
)
@click.option("--wind", type=click.FloatRange(0, 20), default=0.0, help="Wind with gusts, m/s.")
@click.option("--wind-from", type=click.FloatRange(0, 360), default=270.0, show_default=True, help="Its direction.")
@click.option("--seed", type=int, default=0, help="Seed of gusts and noise.")
@click.option("--mass", type=click.FloatRange(0.3, 4), default=1.0, show_default=True, help="The craft's weight, kg.")
@click.option(
    "--lie",
    "lies",
    metavar="NAME=VALUE",
    multiple=True,
    help=f"What is wrong with the craft: {', '.join(NAMES)}. May be repeated.",
)
@click.option("--svg", type=PATH, help="Draw the track into this file.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object.")
@click.pass_context
def fly(
    ctx: click.Context,
    file: Path,
    image: Path,
    flash: Path | None,
    wind: float,
    wind_from: float,
    seed: int,
    mass: float,
    lies: tuple[str, ...],
    svg: Path | None,
    as_json: bool,
) -> None:
    """Fly a mission file in a simulated sky, with your own firmware.

    Needs a TestCode3 with mission flight (docs/howto/try-a-mission.md). Nothing is sent to a real craft.

    Exit code 1: the mission was not flown as in the file, or the craft crashed or went out of bounds.
    """
    records = _records(file)
    try:
        firmware = read_image(image)
    except click.ClickException as error:
        _refuse(error.message)
    from simulator.flights.wrongs import Wrongs

    try:
        wrongs = Wrongs(lies)
    except ValueError as error:
        _refuse(str(error))
    weather = Weather(wind=wind, wind_from=wind_from, seed=seed)
    place = Place(lat=records[0].lat_e7 / 1e7, lon=records[0].lon_e7 / 1e7)
    try:
        run, results = _fly(firmware, image.name, flash, records, weather, place, mass, wrongs, quiet=as_json)
    except _unfit() as error:
        _refuse(str(error))
    from simulator.flights.judgement import extremes, is_flown
    from simulator.flights.track_picture import track_svg

    found = extremes(run, place)
    flown = is_flown(results) and not found.problem
    if as_json:
        items = [asdict(result) for result in results]
        ending = run.reason.name.lower()
        print_json(
            {
                "file": shown_path(file),
                "flown": flown,
                "reason": ending,
                "seconds": _seconds(run),
                **asdict(found),
                "problem": found.problem,
                "items": items,
            }
        )
    else:
        print_table(_table(results))
        say(
            f"At most {found.farthest_m:.0f} m from home and {found.off_legs_m:.0f} m from the mission's legs, "
            f"{found.fastest:.1f} m/s, leaning {found.steepest_deg:.0f} degrees{run.compass}."
        )
        ending = f"Not flown: {found.problem}" if found.problem else "Flown" if flown else "Not flown"
        say(f"{ending}, in {_seconds(run):.0f} s.")
    if svg:
        try:
            title = f"{shown_path(file)}, wind {wind:g} m/s, seed {seed}"
            write_file(svg, track_svg(run.track, records, place, title), FileError)
        except FileError as error:
            _refuse(str(error))
    ctx.exit(FlyStatus.FLOWN if flown else FlyStatus.NOT_FLOWN)


def _refuse(text: str) -> NoReturn:
    fail(text, FlyStatus.UNUSABLE)


def _unfit() -> tuple[type[Exception], ...]:
    from simulator.emulated_naze.console import ConsoleError
    from simulator.flights.mission_upload import UnfitImageError
    from simulator.flights.pilot import PilotError

    return ConsoleError, UnfitImageError, PilotError


def _records(file: Path) -> tuple[WpRecord, ...]:
    """The list as the board would store it."""
    try:
        settings = RuleSettings(takeoff_limit_m())
        rules = next(profile.rules for profile in PROFILES if profile.check_kind == _KIND and profile.rules)
        verdict = check_list(load_mission(file), rules(settings), None)
    except (MissionFileError, SettingsError) as error:
        _refuse(str(error))
    if verdict.result is not Result.ACCEPTED:
        _refuse(
            f"{shown_path(file)} is no mission to fly: {verdict.findings[-1].text() if verdict.findings else 'empty'}"
        )
    return verdict.records


def _flash(path: Path) -> bytes:
    try:
        contents = read_file(path, FileError)
    except FileError as error:
        _refuse(str(error))
    if len(contents) != FLASH_SIZE:
        _refuse(
            f"{shown_path(path)} has {len(contents)} bytes instead of {FLASH_SIZE}: make it with sim --image --flash"
        )
    return contents


def _fly(
    firmware: Image,
    name: str,
    flash_file: Path | None,
    records: tuple[WpRecord, ...],
    weather: Weather,
    place: Place,
    mass: float,
    wrongs: "Wrongs",
    *,
    quiet: bool,
) -> "tuple[MissionRun, list[ItemResult]]":
    from simulator.emulated_naze.flying_naze import FlyingNaze
    from simulator.emulated_naze.prepared_flash import prepared_flash
    from simulator.flights.judgement import judge
    from simulator.flights.mission_run import fly_mission
    from simulator.flights.mission_upload import require_mission_flight, upload
    from simulator.flights.pilot import Pilot

    def say_progress(text: str) -> None:
        if not quiet:
            say(text)

    contents = _flash(flash_file) if flash_file else prepared_flash(firmware, say_progress, _SETTINGS)
    naze = FlyingNaze(
        firmware,
        memoryview(bytearray(contents)),
        weather=weather,
        frame=Airframe().scaled(mass),
        place=place,
        lies=wrongs.lies,
    )
    pilot = Pilot(naze)
    say_progress(f"{name} boots.")
    pilot.power_on()
    require_mission_flight(pilot.console, name)
    upload(pilot.console, records)
    say_progress(f"{len(records) - 1} commands are on the board. It flies, in wind of {weather.wind:g} m/s.")
    run = fly_mission(pilot, records, wrongs.happen)
    return run, judge(run, place)


def _seconds(run: "MissionRun") -> float:
    return round(run.track.last.at_s - run.begun_s, 1)


def _table(results: "list[ItemResult]") -> Table:
    table = Table(box=None, pad_edge=False)
    for title in ("WP", "command", "reached s", "near m", "high m", "held s", "turned", "problems"):
        table.add_column(title, justify="left" if title in ("command", "problems") else "right")
    for result in results:
        high = "" if result.height_m is None else f"{result.height_m:.1f}"
        planned = "" if result.planned_height_m is None else f" of {result.planned_height_m:.0f}"
        table.add_row(
            str(result.number),
            result.command,
            _number(result.reached_s, 0),
            _number(result.distance_m, 1),
            f"{high}{planned}" if high else "",
            _number(result.held_s, 1),
            _number(result.turned_deg, 0),
            "; ".join(result.problems) or "-",
        )
    return table


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
