# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet settings`: the flight controllers' settings of many vehicles, compared and restored."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click
from rich.table import Column, Table
from rich.text import Text

from fleet.conditions import Condition
from fleet.options import address_options, fleet_session, json_option, staged_option, vehicle_option, vehicles_options
from fleet.push_command import Pushed, end, push_file, require_choice, vehicles_meant
from fleet.roll_call import alive, chosen
from fleet.settings import SettingsTrial, read_settings, try_settings, variants
from fleet.tables import in_few_words
from payloads.keys import SETTINGS_RESTORE
from protocols.param_file import ParamFileError, read_param_file, shown_value
from terminal.command_group import CommandGroup
from terminal.files import read_file, shown_path
from terminal.options import PATH
from terminal.printing import print_json, print_table
from terminal.sentences import UNREADABLE, fail

_SETTINGS = Pushed(
    SETTINGS_RESTORE,
    "Restore",
    "have saved these settings",
    "stopped; restores in progress continue: `naze-bridge fleet settings diff` shows the settings later",
)


@click.group("settings", cls=CommandGroup)
def fleet_settings() -> None:
    """Compare and restore the flight controllers' settings of many vehicles."""


@fleet_settings.command("diff")
@vehicle_option
@address_options
@json_option
def diff_settings(names: tuple[str, ...], as_json: bool, **where: Any) -> None:
    """Show the settings in which vehicles differ: all that are alive, or those named.

    Exit code 1: they differ, or the settings of one are not known.
    """
    with fleet_session(where) as (session, prefix):
        held = read_settings(session, prefix, chosen(alive(session, prefix), names, prefix))
    read = [each for each in held if each.error is None]
    failed = [each for each in held if each.error is not None]
    found = variants(read)
    if as_json:
        settings = {name: [asdict(variant) for variant in each] for name, each in found.items()}
        print_json({"settings": settings, "errors": {each.vehicle: each.error for each in failed}})
    else:
        if found:
            table = Table("Setting", Column("Value", justify="right"), "Vehicles", box=None, pad_edge=False)
            for name, each in found.items():
                for place, variant in enumerate(each):
                    value = "-" if variant.value is None else shown_value(variant.value)
                    table.add_row(name if place == 0 else "", Text(value), Text(in_few_words(variant.vehicles)))
            print_table(table)
        click.echo(f"{len(found)} settings differ between {len(read)} vehicles")
        for vehicle in failed:
            click.echo(f"{vehicle.vehicle}: {vehicle.error}", err=True)
    if found or failed:
        raise SystemExit(1)


@fleet_settings.command("restore")
@click.argument("file", type=PATH)
@vehicles_options
@staged_option
@click.option("--dry-run", is_flag=True, help="Show what each vehicle would change; write nothing.")
@address_options
@json_option
def restore_settings(
    file: Path,
    names: tuple[str, ...],
    to_all: bool,
    conditions: list[Condition],
    staged: bool,
    dry_run: bool,
    as_json: bool,
    **where: Any,
) -> None:
    """Write the settings of a .param file to vehicles, save them, and verify them there.

    A vehicle that fails does not stop the others, unless --staged. Exit code 1: one does not have them (--dry-run:
    could not take them).
    """
    require_choice(names, to_all)
    data, count = _read(file)
    with fleet_session(where) as (session, prefix):
        bridges, found, unknown = vehicles_meant(session, prefix, names, conditions)
        if dry_run:
            _show_trials(try_settings(session, prefix, found, data), unknown, as_json)
            return
        has_failed = push_file(session, prefix, bridges, found, data, count, _SETTINGS, staged=staged, as_json=as_json)
    end(unknown, is_bad=has_failed)


def _read(file: Path) -> tuple[bytes, int]:
    try:
        data = read_file(file, ParamFileError)
        return data, len(read_param_file(data, shown_path(file)).values)
    except ParamFileError as error:
        fail(error, UNREADABLE)


def _show_trials(trials: list[SettingsTrial], unknown: str, as_json: bool) -> None:
    cannot = [trial for trial in trials if trial.plan is None or trial.plan.get("left_out")]
    if as_json:
        print_json({"vehicles": [asdict(trial) for trial in trials], "failed": len(cannot)})
    else:
        table = Table("Vehicle", "Would change", Column("Details", overflow="fold"), box=None, pad_edge=False)
        for trial in trials:
            table.add_row(Text(trial.vehicle), *map(Text, _summary(trial)))
        print_table(table)
        click.echo(
            f"{len(trials) - len(cannot)} of {len(trials)} vehicles could take all settings; nothing was written"
        )
    end(unknown, is_bad=bool(cannot))


def _summary(trial: SettingsTrial) -> tuple[str, str]:
    """The number of changes, and the rest in words."""
    if trial.plan is None:
        return "-", trial.error or ""
    changes, left_out = (trial.plan.get(key) or [] for key in ("changes", "left_out"))
    names = in_few_words([str(each.get("name")) for each in left_out])
    details = [f"cannot be set: {names}"] if left_out else []
    return str(len(changes)), "; ".join([*details, *filter(None, [trial.plan.get("notice")])])
