# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet push` and `fleet verify`: one mission for many vehicles."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import zenoh

from fleet.missions import Trial, try_mission
from fleet.options import (
    address_options,
    fleet_session,
    json_option,
    staged_option,
    vehicles_options,
)
from fleet.push import FleetPush, push
from fleet.roll_call import alive, chosen
from fleet.tables import (
    dry_run_table,
    push_bar,
    push_data,
    push_summary,
    push_table,
    verify_table,
)
from payloads.keys import UPLOAD, ZenohKey
from protocols.mission_file import MissionFileError, read_mission_file
from terminal.command_group import PATH
from terminal.files import read_file, shown_path
from terminal.printing import print_json, print_table
from terminal.sentences import INTERRUPTED, UNREADABLE, complain, fail


@dataclass(frozen=True, slots=True)
class Pushed:
    """A kind of push: the key, the table's heading, the end of the summary, and the sentence after Ctrl-C."""

    key: ZenohKey
    heading: str
    summary: str
    interrupted: str


_MISSION = Pushed(
    UPLOAD,
    "Push",
    "hold the mission",
    "stopped; transfers in progress continue: `naze-bridge fleet verify` shows their results later",
)


@click.command("push", short_help="Write a mission file to vehicles, and verify it.")
@click.argument("file", type=PATH)
@vehicles_options
@staged_option
@click.option("--dry-run", is_flag=True, help="Show how each vehicle would store the mission; write nothing.")
@address_options
@json_option
def push_mission(
    file: Path,
    names: tuple[str, ...],
    to_all: bool,
    staged: bool,
    dry_run: bool,
    as_json: bool,
    **where: Any,
) -> None:
    """Write a mission file to vehicles, each by its own rules, and verify it there.

    A vehicle that fails does not stop the others, unless --staged. Exit code 1: a vehicle does not hold it
    (--dry-run: would not accept it), or did not answer.
    """
    require_choice(names, to_all)
    mission = _read(file)
    with fleet_session(where) as (session, prefix):
        bridges = alive(session, prefix)
        meant = chosen(bridges, names, prefix)
        if dry_run:
            _show_trials(try_mission(session, prefix, meant, bridges, mission), as_json)
            return
        delivery = FleetPush(meant)
        if staged:
            # An interrupted push continues with the vehicles that do not hold the mission yet.
            for trial in try_mission(session, prefix, meant, bridges, mission):
                if trial.is_held:
                    delivery.held(trial.vehicle, f"Mission held already: {trial.count} records")
        push_file(session, prefix, delivery, mission, _MISSION, staged=staged, as_json=as_json)


@click.command("verify", short_help="Compare the missions on vehicles with a file.")
@click.argument("file", type=PATH)
@vehicles_options
@address_options
@json_option
def verify_mission(file: Path, names: tuple[str, ...], to_all: bool, as_json: bool, **where: Any) -> None:
    """Compare the missions on vehicles with a file, by checksum, as stored under each vehicle's rules.

    Exit code 1: a vehicle does not hold it, or did not answer.
    """
    require_choice(names, to_all)
    mission = _read(file)
    with fleet_session(where) as (session, prefix):
        bridges = alive(session, prefix)
        meant = chosen(bridges, names, prefix)
        trials = try_mission(session, prefix, meant, bridges, mission)
    held = sum(trial.is_held is True for trial in trials)
    if as_json:
        print_json({"vehicles": [asdict(each) | {"is_held": each.is_held} for each in trials]})
    else:
        print_table(verify_table(trials))
        click.echo(f"{held} of {len(trials)} vehicles hold the mission")
    if held < len(trials):
        raise SystemExit(1)


def _read(file: Path) -> bytes:
    try:
        mission = read_file(file, MissionFileError)
        read_mission_file(mission, shown_path(file))
    except MissionFileError as error:
        fail(error, UNREADABLE)
    return mission


def require_choice(names: tuple[str, ...], to_all: bool) -> None:
    if bool(names) == to_all:
        raise click.UsageError("specify the vehicles: --vehicle NAME, or --all")


def push_file(
    session: zenoh.Session,
    prefix: str,
    delivery: FleetPush,
    file: bytes,
    what: Pushed,
    *,
    staged: bool,
    as_json: bool,
) -> None:
    """Push a file and print the outcome. Exit code 1: a vehicle failed."""
    is_stopped = False
    try:
        with push_bar() as show:
            push(session, prefix, delivery, file, show, staged=staged, key=what.key)
    except KeyboardInterrupt:
        is_stopped = True
    if as_json:
        print_json(push_data(delivery))
    else:
        print_table(push_table(delivery, what.heading))
        click.echo(push_summary(delivery, what.summary))
    if is_stopped:
        complain(what.interrupted)
        raise SystemExit(INTERRUPTED)
    if delivery.failed:
        raise SystemExit(1)


def _show_trials(trials: list[Trial], as_json: bool) -> None:
    failed = sum(trial.error is not None for trial in trials)
    if as_json:
        print_json({"vehicles": [asdict(each) for each in trials], "failed": failed})
    else:
        print_table(dry_run_table(trials))
        click.echo(f"{len(trials) - failed} of {len(trials)} vehicles would accept the mission; nothing was written")
    if failed:
        raise SystemExit(1)
