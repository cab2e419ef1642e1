# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fly`: a mission file flown by a real firmware image in the simulated sky, and judged."""

from pathlib import Path

import click
from rich.table import Table

from bridge.controllers.table import PROFILES
from bridge.fc.profile import RuleSettings
from bridge.missions.list_check import check_list
from protocols.mission_file import MissionFileError
from protocols.msp.mission import WpRecord
from protocols.plain_text import FileError
from reports.verdict import Result
from service.settings import SettingsError, takeoff_limit_m
from simulator.commands.image import read_image
from simulator.sky.lies import NAMES
from simulator.sky.sky import Weather
from terminal.command_group import PATH
from terminal.files import assumed_home, load_mission, read_file, shown_path, write_file
from terminal.printing import print_json, print_table
from terminal.sentences import fail, say

#: The exit status of wrong input.
_UNUSABLE = 2


@click.command()
@click.argument("file", type=PATH)
@click.option("--image", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="The firmware to fly.")
@click.option("--log", type=PATH, help="Judge the real flight in this telemetry log instead.")
@click.option("--flash", type=PATH, help="The flash of your own board (sim --flash). Default: a prepared board.")
@click.option("--wind", type=click.FloatRange(0, 20), default=0.0, help="Wind with gusts, m/s.")
@click.option("--wind-from", type=click.FloatRange(0, 360), default=270.0, show_default=True, help="Its direction.")
@click.option("--seed", type=int, default=0, help="Seed for gusts and noise.")
@click.option("--mass", type=click.FloatRange(0.3, 4), default=1.0, show_default=True, help="The craft's weight, kg.")
@click.option("--lie", "lies", metavar="NAME=VALUE", multiple=True, help=f"A fault, repeatable: {', '.join(NAMES)}.")
@click.option("--svg", type=PATH, help="Draw the track to this file.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object.")
def fly(
    file: Path,
    image: Path | None,
    log: Path | None,
    flash: Path | None,
    wind: float,
    wind_from: float,
    seed: int,
    mass: float,
    lies: tuple[str, ...],
    svg: Path | None,
    as_json: bool,
) -> None:
    """Fly a mission file in a simulation, with your own firmware, or assess a real flight of it.

    Needs a TestCode3 with mission flight (docs/howto/try-a-mission.md). The mission is not sent to a real craft.

    Exit code 1: the mission was not flown as in the file, or the craft crashed or went out of bounds.
    """
    records = _records(file)
    from simulator.flights.logged_flight import logged_sortie
    from simulator.flights.sortie import SortieError, fly_sortie

    try:
        if log is not None:
            flight, title = logged_sortie(read_file(log, FileError), records), shown_path(log)
        elif image is None:
            fail("give a firmware, --image FILE, or the telemetry log of a flight, --log FILE", _UNUSABLE)
        else:
            weather = Weather(wind=wind, wind_from=wind_from, seed=seed)
            contents = read_file(flash, FileError) if flash else None
            progress = (lambda _: None) if as_json else say
            flight = fly_sortie(read_image(image), image.name, records, weather, mass, lies, contents, progress)
            title = f"{shown_path(file)}, wind {wind:g} m/s, seed {seed}"
        if svg:
            write_file(svg, flight.svg(title), FileError)
    except (SortieError, FileError, click.ClickException) as error:
        fail(error, _UNUSABLE)
    if as_json:
        print_json({"file": shown_path(file), **flight.to_json()})
    else:
        table = Table(box=None, pad_edge=False)
        for title in flight.titles:
            table.add_column(title, justify="left" if title in ("command", "problems") else "right")
        for row in flight.rows():
            table.add_row(*row)
        print_table(table)
        say(flight.summary())
    raise SystemExit(0 if flight.is_flown else 1)


def _records(file: Path) -> tuple[WpRecord, ...]:
    """The list as the board would store it."""
    try:
        settings = RuleSettings(takeoff_limit_m())
        rules = next(profile.rules for profile in PROFILES if profile.check_kind == "harakiri" and profile.rules)
        items = load_mission(file)
        verdict = check_list(items, rules(settings), assumed_home(items, shown_path(file)))
    except (MissionFileError, SettingsError) as error:
        fail(error, _UNUSABLE)
    if verdict.result is not Result.ACCEPTED:
        why = verdict.findings[-1].text() if verdict.findings else "empty"
        fail(f"{shown_path(file)} is not a mission to fly: {why}", _UNUSABLE)
    return verdict.records
