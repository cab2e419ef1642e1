# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet settings`: the flight controllers' settings of many vehicles, compared and restored."""

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import click
import zenoh
from rich.table import Column, Table
from rich.text import Text

from fleet.options import address_options, fleet_session, json_option, staged_option, vehicle_option, vehicles_options
from fleet.payload import objects, part, text
from fleet.push import FleetPush
from fleet.push_command import Pushed, push_file, require_choice
from fleet.roll_call import alive, chosen
from fleet.session import NO_COMMANDS, NOT_UNDERSTOOD, answer_of, ask_each
from fleet.tables import in_few_words
from payloads.keys import SETTINGS_LIST, SETTINGS_PLAN, SETTINGS_RESTORE
from payloads.mission_data import Json
from payloads.settings_comparison import SettingValues, setting_values
from protocols.param_file import ParamFileError, is_equal, read_param_file, shown_value
from terminal.command_group import PATH, CommandGroup
from terminal.files import read_file, shown_path
from terminal.printing import print_json, print_table
from terminal.sentences import UNREADABLE, fail

#: INAV's table takes some seconds.
_TIMEOUT_S = 40.0


@dataclass(slots=True)
class HeldSettings:
    """One vehicle's settings. board: the firmware and the version. error: why they are not known."""

    vehicle: str
    board: str = ""
    values: SettingValues = field(default_factory=dict)
    error: str | None = NO_COMMANDS


@dataclass(frozen=True, slots=True)
class SettingVariant:
    """A value of a setting, and the vehicles that have it. None if they lack it."""

    value: float | str | None
    vehicles: tuple[str, ...]


@dataclass(slots=True)
class SettingsTrial:
    """The plan of a restore on one vehicle. `plan`: of SettingsApi.plan, None with an error."""

    vehicle: str
    plan: Json | None = None
    error: str | None = NO_COMMANDS


def read_settings(session: zenoh.Session, prefix: str, names: Collection[str]) -> list[HeldSettings]:
    """Each vehicle's settings, checked against its flight controller unless it is armed."""
    found = {name: HeldSettings(name) for name in names}
    for name, reply in ask_each(session, prefix, names, SETTINGS_LIST.suffix, _TIMEOUT_S):
        if reply is None:
            continue
        result, found[name].error = answer_of(reply)
        if result is None:
            continue
        try:
            found[name].values = setting_values(part(result, "values"))
            found[name].board = text(result, "board") or ""
        except ValueError as error:
            found[name].error = f"{NOT_UNDERSTOOD}: {error}"
    return list(found.values())


def try_settings(session: zenoh.Session, prefix: str, names: Collection[str], file: bytes) -> list[SettingsTrial]:
    """The plans of restoring this .param file, for each vehicle."""
    trials = {name: SettingsTrial(name) for name in names}
    for name, reply in ask_each(session, prefix, names, SETTINGS_PLAN.suffix, _TIMEOUT_S, file):
        if reply is not None:
            result, trials[name].error = answer_of(reply)
            trials[name].plan = result
    return list(trials.values())


def variants(held: Sequence[HeldSettings]) -> dict[str, list[SettingVariant]]:
    """The settings in which vehicles differ, by name, the most common value first.

    A setting that a vehicle lacks is a difference only from vehicles with the same firmware and version.
    """
    found: dict[str, list[SettingVariant]] = {}
    for name in dict.fromkeys(name for each in held for name in each.values):
        groups: list[tuple[float | str | None, list[str]]] = []
        boards = {each.board for each in held if name in each.values}
        for each in held:
            if name not in each.values and each.board not in boards:
                continue
            value = each.values.get(name)
            group = next((names for known, names in groups if _is_same(known, value)), None)
            if group is None:
                groups.append((value, [each.vehicle]))
            else:
                group.append(each.vehicle)
        if len(groups) > 1:
            groups.sort(key=lambda group: -len(group[1]))
            found[name] = [SettingVariant(value, tuple(names)) for value, names in groups]
    return found


def _is_same(value: float | str | None, other: float | str | None) -> bool:
    return value is other or (value is not None and other is not None and is_equal(value, other))


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

    Exit code 1: they differ, or those of a vehicle are not known.
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
    staged: bool,
    dry_run: bool,
    as_json: bool,
    **where: Any,
) -> None:
    """Write the settings of a .param file to vehicles, save them, and verify them there.

    A vehicle that fails does not stop the others, unless --staged. Exit code 1: a vehicle does not have them
    (--dry-run: could not take them).
    """
    require_choice(names, to_all)
    data = _read(file)
    with fleet_session(where) as (session, prefix):
        found = chosen(alive(session, prefix), names, prefix)
        if dry_run:
            _show_trials(try_settings(session, prefix, found, data), as_json)
            return
        push_file(session, prefix, FleetPush(found), data, _SETTINGS, staged=staged, as_json=as_json)


def _read(file: Path) -> bytes:
    try:
        data = read_file(file, ParamFileError)
        read_param_file(data, shown_path(file))
    except ParamFileError as error:
        fail(error, UNREADABLE)
    return data


def _show_trials(trials: list[SettingsTrial], as_json: bool) -> None:
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
    if cannot:
        raise SystemExit(1)


def _summary(trial: SettingsTrial) -> tuple[str, str]:
    """The number of changes, and the rest in words."""
    if trial.plan is None:
        return "-", trial.error or ""
    left_out = [text(each, "name") or "?" for each in objects(trial.plan, "left_out")]
    details = [f"cannot be set: {in_few_words(left_out)}"] if left_out else []
    return str(len(objects(trial.plan, "changes"))), "; ".join(filter(None, [*details, text(trial.plan, "notice")]))
