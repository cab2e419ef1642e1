# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge settings`: the flight controller's settings, their backups, and restoring them."""

import sys
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path

import click
from rich.table import Column, Table
from rich.text import Text

from payloads.mission_data import MOST, Json
from payloads.settings_comparison import SettingRow, SettingValues, setting_values, settings_difference
from protocols.param_file import ParamFileError, shown_value, write_param_file
from protocols.settings_file import read_settings_file, unread_text, write_dump
from service.cli.daemon_client import BridgeClient, bridge_options, daemon_options
from terminal.command_group import PATH, CommandGroup
from terminal.files import read_file, shown_path, write_file
from terminal.printing import print_json, print_table
from terminal.sentences import UNREADABLE, complain, fail, say

_STANDARD_OUTPUT = Path("-")
_BOARD = "board"
_NO_BOARD: Json = {"settings": []}
_DUMP = ".txt"
_MODE = "MODE_"
#: Their settings have the names of the board's command line.
_WITH_DUMPS = ("INAV", "Harakiri")


@click.group(cls=CommandGroup)
def settings() -> None:
    """Read, change, save, back up and restore the flight controller's settings.

    A change acts at once, and is lost at power-off unless it is saved. It is refused while the craft is armed.
    """


@settings.command("list")
@bridge_options
def list_settings(client: BridgeClient) -> None:
    """List all settings with their values and ranges. Long names are shortened for MAVLink parameters."""
    held = _held(client)
    client.show(held, lambda: _print_settings(held))


def _print_settings(held: Json) -> None:
    from bridge.settings.parameter_names import parameter_names

    parameters = {name: parameter for parameter, name in parameter_names(_values(held)).items()}
    table = Table("Name", "MAVLink", Column("Value", justify="right"), "Range", box=None, pad_edge=False)
    for each in held["settings"]:
        parameter = parameters.get(each["name"], "")
        row = "" if parameter == each["name"].upper() else parameter, each["shown"], each["fixed"] or each["range"]
        table.add_row(each["name"], *map(Text, row))
    print_table(table)
    click.echo(f"\n{len(held['settings'])} settings of {held['board']}")


@settings.command()
@bridge_options
def modes(client: BridgeClient) -> None:
    """List the modes with the channels and the pulses in us that turn them on. Change one with `settings set`."""
    held = _held(client)
    rows = [each for each in held["settings"] if each["name"].startswith(_MODE)]
    if not rows:
        fail(f"{held['board']} has boxes instead of mode ranges: see its settings in `settings list`")
    client.show({"modes": rows}, lambda: _print_modes(rows))


def _print_modes(rows: list[Json]) -> None:
    table = Table("Mode", "Channel", "From", "To", box=None, pad_edge=False)
    for each in rows:
        for held in each["shown"].split("; "):
            channel, _, pulses = held.partition(" ")
            table.add_row(Text(each["name"]), channel, *pulses.split("-"))
    print_table(table)


@settings.command("get")
@click.argument("name")
@bridge_options
def get_setting(client: BridgeClient, name: str) -> None:
    """Print the value of the setting NAME."""
    found = client.ask({"do": "setting", "name": name})
    client.show(found, lambda: click.echo(found["shown"]))


@settings.command("set", context_settings={"ignore_unknown_options": True})
@click.argument("name")
@click.argument("value")
@bridge_options
def set_setting(client: BridgeClient, name: str, value: str) -> None:
    """Change the setting NAME to VALUE, until power-off unless it is saved."""
    changed = client.ask({"do": "set-setting", "name": name, "value": value})
    client.show(changed, lambda: say(changed["text"]))


@settings.command("save")
@bridge_options
def save_settings(client: BridgeClient) -> None:
    """Save all changes in the flight controller."""
    saved = client.ask({"do": "save-settings"})
    client.show(saved, lambda: say(saved["text"]))


@settings.command()
@click.argument("file", type=PATH)
@bridge_options
def backup(client: BridgeClient, file: Path) -> None:
    """Write the settings to FILE, in Mission Planner's .param format; - is standard output.

    A FILE that ends with .txt becomes a dump, the commands that set them on the command line of an INAV or a Harakiri.
    """
    if client.as_json and file == _STANDARD_OUTPUT:
        raise click.UsageError("the file and --json cannot both go to standard output: omit one of them")
    from bridge.settings.local_settings import by_parameter

    held = _held(client)
    comment = f"taken: {datetime.now().astimezone().strftime('%Y-%m-%d %H:%M %z')}, by naze-bridge"
    if file.suffix.lower() != _DUMP:
        text = write_param_file(by_parameter(_values(held)), held["board"], [comment])
    elif held["board"].startswith(_WITH_DUMPS):
        text = write_dump({each["name"]: each["shown"] for each in held["settings"]}, held["board"], [comment])
    else:
        fail(f"the command line of {held['board']} has other names for these settings: use a file that ends in .param")
    if file == _STANDARD_OUTPUT:
        click.echo(text, nl=False)
        return
    try:
        write_file(file, text, ParamFileError)
    except ParamFileError as error:
        fail(error)
    written = f"{len(held['settings'])} settings of {held['board']} written to {shown_path(file)}"
    client.show(held, lambda: click.echo(written))


@settings.command()
@click.argument("source")
@click.option("--dry-run", is_flag=True, help="Show what would be written; write nothing.")
@bridge_options
def restore(client: BridgeClient, source: str, dry_run: bool) -> None:
    """Write the settings of SOURCE to the flight controller, save them, and verify them.

    SOURCE is a .param file, a dump (`dump` or `diff all` of INAV, Betaflight, Cleanflight or Harakiri) or the number
    of a backup. Lines of a dump that are not settings are listed. All differences are shown first, and in a
    terminal the command asks before it writes. Exit code 1: the flight controller does not hold all settings of SOURCE.
    """
    values, board = _source(client, source)
    request: Json = {"do": "plan-settings", "values": dict(values), "board": board}
    plan = client.ask(request)
    if not client.as_json:
        _show_plan(plan)
    if dry_run:
        if client.as_json:
            print_json(plan)
        raise SystemExit(1 if plan["changes"] or plan["left_out"] else 0)
    if not plan["changes"] and not client.as_json:
        raise SystemExit(1 if plan["left_out"] else 0)
    if not client.as_json and sys.stdin.isatty():
        click.confirm(f"Write and save {len(plan['changes'])} settings?", abort=True, err=True)
    result = client.ask_with_progress(request | {"do": "restore-settings"}, len(plan["changes"]))
    if client.as_json:
        print_json({"plan": plan, "result": result})
    else:
        _show_left_out([each for each in result["left_out"] if each not in plan["left_out"]])
        say(result["text"])
    if not result["is_saved"] or result["left_out"]:
        raise SystemExit(1)


@settings.command()
@click.argument("first")
@click.argument("second", default=_BOARD)
@bridge_options
def diff(client: BridgeClient, first: str, second: str) -> None:
    """Compare the settings of FIRST and SECOND. Exit code 1 if they differ.

    Each is a .param file, a dump, a backup number, or `board` for the flight controller's present settings (the
    default of SECOND).
    """
    from bridge.settings.local_settings import by_setting  # other commands do without the bridge

    held = _held(client) if _BOARD in (first, second) else _NO_BOARD
    (left, _), (right, _) = (_source(client, each, held) for each in (first, second))
    left = by_setting(left, right)
    right = by_setting(right, left)
    if _is_file(first) is not _is_file(second):
        # A `diff all` has only what differs from the defaults.
        file, values = (first, left) if _is_file(first) else (second, right)
        absent = len((left | right).keys() - values.keys())
        left, right = ({name: each[name] for name in values if name in each} for each in (left, right))
        if absent:
            complain(f"{absent} settings are not in {shown_path(Path(file))}: not compared")
    rows = settings_difference(_like(left, right, held), _like(right, left, held))
    if client.as_json:
        print_json({"equal": not rows, "changes": [asdict(row) for row in rows]})
    elif rows:
        print_table(rows_table(rows, first, second))
    else:
        click.echo("no difference")
    if rows:
        raise SystemExit(1)


@settings.command()
@click.option("--limit", type=click.IntRange(1, MOST), default=20, show_default=True, help="The maximum number.")
@daemon_options
def history(client: BridgeClient, limit: int) -> None:
    """List the backups, newest first. A backup is made when a board is first seen, and at every change."""
    found = client.ask({"do": "backups", "limit": limit})["backups"]
    if client.as_json:
        print_json(found)
        return
    if not found:
        click.echo("No settings have been backed up yet.")
        return
    table = Table(
        "No.", "Taken", "Settings", "Changed", "Why", Column("Board", overflow="fold"), box=None, pad_edge=False
    )
    for each in found:
        changed = "-" if each["changed_count"] is None else str(each["changed_count"])
        when = datetime.fromtimestamp(each["taken_at"]).astimezone().strftime("%Y-%m-%d %H:%M")
        board = Text(f"{each['kind']}, {each['board']}")
        table.add_row(str(each["number"]), when, str(each["setting_count"]), changed, each["occasion"], board)
    print_table(table)


def rows_table(rows: list[SettingRow], first: str, second: str) -> Table:
    """Settings that differ, side by side."""
    table = Table(
        "Name", *(Column(Text(title), justify="right") for title in (first, second)), box=None, pad_edge=False
    )
    for row in rows:
        table.add_row(
            row.name, *(Text("-" if value is None else shown_value(value)) for value in (row.left, row.right))
        )
    return table


def _like(values: SettingValues, other: SettingValues, held: Json) -> SettingValues:
    """The values of a dump, which are texts, as numbers where the other side has numbers."""
    choices = {
        (each["name"], choice.lower()): each["minimum"] + number
        for each in held["settings"]
        for number, choice in enumerate(each["choices"])
    }

    def number(name: str, text: str) -> float | str:
        try:
            return float(choices.get((name, text.lower()), text))
        except ValueError:
            return text

    return {
        name: number(name, value) if isinstance(value, str) and isinstance(other.get(name), float) else value
        for name, value in values.items()
    }


def _source(client: BridgeClient, name: str, held: Json | None = None) -> tuple[SettingValues, str]:
    """The settings that a word on the command line names, and the board they are from, or "" if it is unknown.

    held: the present board's, if they are known already.
    """
    if name == _BOARD:
        held = held or _held(client)
        return _values(held), held["board"]
    if not _is_file(name):
        if int(name) > MOST:
            raise click.UsageError(f"{name} is not a backup number: see `naze-bridge settings history`")
        stored = replace(client, fc=None).ask({"do": "backup", "number": int(name)})
        return setting_values(stored["values"]), stored["kind"]
    try:
        found = read_settings_file(read_file(Path(name), ParamFileError), shown_path(Path(name)))
    except ParamFileError as error:
        fail(error, UNREADABLE)
    if found.unread:
        complain(f"{shown_path(Path(name))}, lines that are not settings: {unread_text(found.unread)}")
    return found.values, found.board


def _is_file(name: str) -> bool:
    """False for `board` and the number of a backup."""
    return name != _BOARD and (Path(name).exists() or not (name.isascii() and name.isdecimal()))


def _held(client: BridgeClient) -> Json:
    """All settings, with a complaint if they may not be up to date."""
    held = client.ask({"do": "settings"})
    if not held["is_checked"]:
        complain("the flight controller cannot be read now: these are its settings as last read")
    if not held["is_complete"]:
        complain("some settings could not be read")
    return held


def _values(held: Json) -> SettingValues:
    return setting_values({each["name"]: each["value"] for each in held["settings"]})


def _show_plan(plan: Json) -> None:
    if plan["changes"]:
        rows = [SettingRow(each["name"], each["was"], each["becomes"]) for each in plan["changes"]]
        print_table(rows_table(rows, "Now", "Restored"))
    _show_left_out(plan["left_out"])
    if plan["notice"]:
        say(plan["notice"], to_error=True)
    if not plan["changes"] and not plan["left_out"]:
        click.echo("Nothing to restore: the flight controller already has these settings.")


def _show_left_out(settings: list[Json]) -> None:
    names: dict[str, list[str]] = {}
    for each in settings:
        held = "" if each["held"] is None else f" stays {shown_value(each['held'])}"
        names.setdefault(each["why"], []).append(f"{each['name']}{held}")
    for why, which in names.items():
        say(f"{', '.join(which)}: {why}", prefix="Left out: ", indent=10)
