# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet`: the commands, and their output."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from fleet.conditions import Condition, matching
from fleet.enroll_command import enroll, expel
from fleet.logs import fleet_logs
from fleet.missions import Held, pull
from fleet.options import (
    address_options,
    fleet_session,
    json_option,
    vehicle_option,
    where_option,
)
from fleet.push_command import push_mission, verify_mission
from fleet.roll_call import alive, chosen, roll_call
from fleet.settings import fleet_settings
from fleet.tables import complaints, fleet_lines, fleet_table
from fleet.watch import watching
from fleet.watch_screen import print_changes, show_screen
from protocols.mission_file import MissionFileError, write_qgc_wpl
from storage.os_error import reason
from terminal.command_group import PATH, CommandGroup
from terminal.files import shown_path, write_file
from terminal.printing import print_json, print_table
from terminal.sentences import complain, fail

_STANDARD_OUTPUT = Path("-")
_MANY = 500


@click.group(cls=CommandGroup)
def fleet() -> None:
    """Monitor and manage many vehicles at once, over Eclipse zenoh (docs/fleet.md)."""


for _command in (push_mission, verify_mission, fleet_settings, fleet_logs, enroll, expel):
    fleet.add_command(_command)


@fleet.command("list")
@address_options
@where_option
@click.option("--limit", type=click.IntRange(1), help="The maximum number of vehicles.")
@json_option
def list_vehicles(as_json: bool, limit: int | None, conditions: list[Condition], **where: Any) -> None:
    """Show which vehicles are alive, and their state.

    Exit code 0 even if there are none; 1: a vehicle or the router does not answer.
    """
    with fleet_session(where) as (session, prefix), fleet_session(where) as (second, _):
        found = matching(everyone := roll_call(session, prefix, second), conditions)
    shown, unanswered = found[:limit], sum(not vehicle.answers for vehicle in everyone)
    if as_json:
        counts = {"alive": len(everyone), "unanswered": unanswered}
        print_json({"vehicles": [asdict(vehicle) for vehicle in shown], "complaints": complaints(everyone)} | counts)
    elif shown:
        if len(shown) > _MANY:
            click.echo("\n".join(fleet_lines(shown)))
        else:
            print_table(fleet_table(shown))
        if len(shown) < len(found):
            click.echo(f"and {len(found) - len(shown):,} more")
    elif everyone:
        click.echo(f"None of the {len(everyone) - unanswered:,} vehicles that answered matches.")
    else:
        click.echo(f"No vehicle is alive under {prefix!r}.")
    for line in () if as_json else complaints(everyone):
        complain(line)
    if unanswered:
        raise SystemExit(1)


@fleet.command(short_help="Show which vehicles are alive, until Ctrl-C.")
@address_options
@where_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object per line for each change.")
def watch(as_json: bool, conditions: list[Condition], **where: Any) -> None:
    """Show which vehicles are alive and their state, until Ctrl-C: armed ones and problems first."""
    with (
        fleet_session(where) as (session, prefix),
        fleet_session(where) as (roll, _),
        watching(session, roll, prefix) as seen,
    ):
        try:
            if as_json:
                print_changes(seen, conditions)
            else:
                show_screen(seen, session, conditions)
        except KeyboardInterrupt:
            return


@fleet.command("pull", short_help="Read the missions of vehicles' flight controllers.")
@click.argument("path", type=PATH, required=False)
@vehicle_option
@address_options
@json_option
def pull_missions(path: Path | None, names: tuple[str, ...], as_json: bool, **where: Any) -> None:
    """Read the missions of vehicles' flight controllers: of all that are alive, or of those named.

    PATH is a folder, in which each vehicle's mission becomes NAME.waypoints. For one named vehicle it may be a file, or
    - for standard output. Without it the missions are shown. Exit code 1: one was not read, or cannot be written.
    """
    to_output = path == _STANDARD_OUTPUT
    if to_output and (len(names) != 1 or as_json):
        raise click.UsageError("standard output takes one mission: name one --vehicle, and omit --json")
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
