# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet`: the commands, and their output."""

import time
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click
from rich.live import Live
from rich.text import Text

from fleet.enroll_command import enroll, expel
from fleet.logs import fleet_logs
from fleet.missions import Held, pull
from fleet.options import address_options, fleet_session, json_option, vehicle_option
from fleet.push_command import push_mission, verify_mission
from fleet.roll_call import alive, chosen, roll_call
from fleet.session import FleetError, is_connected
from fleet.settings import fleet_settings
from fleet.tables import complaints, fleet_lines, watch_lines
from protocols.mission_file import MissionFileError, write_qgc_wpl
from storage.os_error import reason
from terminal.command_group import PATH, CommandGroup
from terminal.files import shown_path, write_file
from terminal.printing import console, print_json, print_table
from terminal.sentences import complain, fail

_STANDARD_OUTPUT = Path("-")
_WATCH_INTERVAL_S = 2.0


@click.group(cls=CommandGroup)
def fleet() -> None:
    """Monitor and manage many vehicles at once, over Eclipse zenoh (docs/fleet.md)."""


for _command in (push_mission, verify_mission, fleet_settings, fleet_logs, enroll, expel):
    fleet.add_command(_command)


@fleet.command("list")
@address_options
@json_option
def list_vehicles(as_json: bool, **where: Any) -> None:
    """Show which vehicles are alive, and their state.

    Exit code 0 even if there are none; 1: a vehicle or the router does not answer.
    """
    with fleet_session(where) as (session, prefix), fleet_session(where) as (second, _):
        everyone = roll_call(session, prefix, second)
    unanswered = sum(not vehicle.answers for vehicle in everyone)
    if as_json:
        counts = {"alive": len(everyone), "unanswered": unanswered}
        print_json({"vehicles": [asdict(vehicle) for vehicle in everyone], "complaints": complaints(everyone)} | counts)
    elif everyone:
        click.echo("\n".join(fleet_lines(everyone)))
    else:
        click.echo(f"No vehicle is alive under {prefix!r}.")
    for line in () if as_json else complaints(everyone):
        complain(line)
    if unanswered:
        raise SystemExit(1)


@fleet.command(short_help="Show which vehicles are alive, until Ctrl-C.")
@address_options
def watch(**where: Any) -> None:
    """Show which vehicles are alive and their state, until Ctrl-C: armed vehicles and problems first."""
    with (
        fleet_session(where) as (session, prefix),
        fleet_session(where) as (second, _),
        suppress(KeyboardInterrupt),
        Live(console=console(), auto_refresh=False, vertical_overflow="crop") as live,
    ):
        while True:
            lines = ["The router is gone; waiting for it."]
            try:
                if is_connected(session):
                    lines = watch_lines(roll_call(session, prefix, second))
            except FleetError as error:
                lines = [str(error)]
            live.update(Text("\n".join(["Ctrl-C ends.", *lines]), no_wrap=True), refresh=True)
            time.sleep(_WATCH_INTERVAL_S)


@fleet.command("pull", short_help="Read the missions of vehicles' flight controllers.")
@click.argument("path", type=PATH, required=False)
@vehicle_option
@address_options
@json_option
def pull_missions(path: Path | None, names: tuple[str, ...], as_json: bool, **where: Any) -> None:
    """Read the missions of vehicles' flight controllers: of all that are alive, or of those named.

    PATH is a folder, in which each vehicle's mission becomes NAME.waypoints. For one named vehicle it may be a file, or
    - for standard output. Without it the missions are shown. Exit code 1: a mission was not read or cannot be written.
    """
    to_output = path == _STANDARD_OUTPUT
    if to_output and (len(names) != 1 or as_json):
        raise click.UsageError("only one mission fits on standard output: give one --vehicle, and omit --json")
    with fleet_session(where) as (session, prefix):
        bridges = alive(session, prefix)
        held = pull(session, prefix, chosen(bridges, names, prefix), bridges)
    for each in held:
        if each.error is None and to_output:
            click.echo(write_qgc_wpl(each.items), nl=False)
        elif each.error is None and path is not None:
            _save(each, path, is_file=len(names) == 1 and not path.is_dir())
        if not as_json:
            _show(each, with_items=path is None, to_error=to_output)
    if as_json:
        print_json({"vehicles": [asdict(each) for each in held]})
    if any(each.error for each in held):
        raise SystemExit(1)


def _save(held: Held, path: Path, *, is_file: bool) -> None:
    try:
        if not is_file:
            path.mkdir(parents=True, exist_ok=True)
        target = path if is_file else path / f"{held.vehicle}.waypoints"
        write_file(target, write_qgc_wpl(held.items), MissionFileError)
    except MissionFileError as error:
        fail(error)
    except OSError as error:
        fail(f"{shown_path(path)} is not a writable folder: {reason(error)}")


def _show(held: Held, *, with_items: bool, to_error: bool) -> None:
    if held.error is not None:
        click.echo(f"{held.vehicle}: {held.error}", err=True)
        return
    click.echo(f"{held.vehicle}: {held.count} records, checksum {held.checksum}", err=to_error)
    if with_items and held.items:
        # Imported here, because the other commands do not need the names of MAV_CMD.
        from terminal.mission_table import mission_table

        print_table(mission_table(held.items, held.items, ()))
