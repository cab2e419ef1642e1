# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge check`: how a flight controller would store a mission file, checked offline."""

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any

import click

from bridge.controllers.inav.limits import SETTING_NAMES
from bridge.controllers.table import PROFILES
from bridge.fc.profile import RuleSettings
from bridge.missions.list_check import MissionRules, check_list, with_home
from bridge.settings.parameter_names import parameter_names
from payloads.mission_data import verdict_data
from protocols.mission_file import MissionFileError
from protocols.mission_item import MissionItem, MissionResult, identify
from protocols.param_file import ParamFileError
from protocols.remedies import Fault
from protocols.settings_file import SavedSettings, read_settings_file, unread_text
from reports.finding import DROPPED, without_defaults
from reports.verdict import Result, Verdict
from service.settings import SettingsError, takeoff_limit_m
from terminal.command_group import PATH, position
from terminal.files import assumed_home, load_mission, read_file, shown_path
from terminal.mission_table import mission_table
from terminal.printing import print_json, print_table
from terminal.sentences import complain, say

#: The rules of each flight controller that stores missions.
_RULES: Mapping[str, Callable[[RuleSettings], MissionRules]] = {
    profile.check_kind: profile.rules for profile in PROFILES if profile.check_kind and profile.rules
}


class ExitCode(IntEnum):
    """The exit status: that of the worst file."""

    ACCEPTED = 0
    REJECTED = 1
    UNREADABLE = 2
    CLEARED = 3


#: From the best to the worst.
_RANKS = (ExitCode.ACCEPTED, ExitCode.CLEARED, ExitCode.REJECTED, ExitCode.UNREADABLE)


@click.command()
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.option(
    "--kind",
    type=click.Choice(list(_RULES)),
    default="harakiri",
    show_default=True,
    help="The firmware whose rules apply.",
)
@click.option(
    "--settings",
    "settings_file",
    type=PATH,
    metavar="FILE",
    help="An INAV's settings, which affect arming, heights and landing places: its `dump` or `diff all`, "
    "or a .param file.",
)
@click.option(
    "--home",
    metavar="LAT,LON",
    callback=position,
    help="The craft's position, and home if the list has none: then item 0 in a relative frame is a waypoint.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object per line for each file.")
@click.pass_context
def check(
    ctx: click.Context,
    files: Sequence[Path],
    kind: str,
    settings_file: Path | None,
    home: tuple[int, int] | None,
    as_json: bool,
) -> None:
    """Show how the flight controller would store mission files.

    Files: QGC WPL (.waypoints), QGroundControl's .plan, Mission Planner's, INAV Configurator's and mwp's .mission, a
    dump with wp lines, KML, KMZ, GPX, and CSV lists as Litchi writes them.

    The files are not sent anywhere. Exit code 1: a file would be rejected, 3: a file would erase the mission.
    """
    try:
        limit_m = takeoff_limit_m()
    except SettingsError as error:
        raise click.UsageError(str(error)) from error
    saved = None if settings_file is None else _saved_settings(settings_file, kind)
    try:
        rules = _RULES[kind](RuleSettings(limit_m, saved))
    except ValueError as error:
        raise click.UsageError(Fault.BAD_SAVED_VALUE.text(why=f"{settings_file}: {error}")) from error
    codes = [_check_file(path, rules, home, as_json) for path in files]
    ctx.exit(max(codes, key=_RANKS.index))


def _saved_settings(path: Path, kind: str) -> SavedSettings:
    if kind != "inav":
        raise click.UsageError(Fault.SETTINGS_OF_OTHERS.text())
    try:
        saved = read_settings_file(read_file(path, ParamFileError), shown_path(path))
    except ParamFileError as error:
        raise click.UsageError(str(error)) from error
    if saved.unread:
        complain(f"{shown_path(path)}, lines that are not settings: {unread_text(saved.unread)}")
    names = parameter_names(SETTING_NAMES)
    return saved._replace(values={names.get(name.upper(), name): value for name, value in saved.values.items()})


def _check_file(path: Path, rules: MissionRules, home: tuple[int, int] | None, as_json: bool) -> ExitCode:
    name = shown_path(path)
    try:
        sent = with_home(load_mission(path, has_home=home is not None), home)
    except MissionFileError as error:
        if as_json:
            print_json({"file": name, "error": str(error)})
        else:
            complain(error)
        return ExitCode.UNREADABLE
    verdict = check_list(sent, rules, home or assumed_home(sent, name))
    if as_json:
        print_json({"file": name, **verdict_data(verdict)})
    else:
        _print_verdict(name, sent, verdict)
    if verdict.result is Result.REJECTED:
        return ExitCode.REJECTED
    return ExitCode.CLEARED if verdict.result is Result.CLEARED else ExitCode.ACCEPTED


def _print_verdict(name: str, sent: Sequence[MissionItem], verdict: Verdict[Any]) -> None:
    click.secho(name, bold=True)
    if verdict.ack is not MissionResult.NO_SPACE:
        print_table(mission_table(sent, verdict.items, verdict.findings, verdict.sent_seqs))
    say(f"{verdict.result.name}: {_summary(len(sent), verdict)}")
    if verdict.assumed:
        say(f"Assumed: {', '.join(verdict.assumed)}")
    if any(finding.seq == 0 and finding.field in ("frame", "command") for finding in verdict.findings):
        say("If {}, {}".format(*Fault.HOME_MISSING()))
    say("")


def _summary(sent: int, verdict: Verdict[Any]) -> str:
    if verdict.result is not Result.ACCEPTED:
        # A single item of zeros (MAVSDK's clear) is without findings.
        why = verdict.findings[-1].text() if verdict.findings else "Mission erased: one item of zeros"
        return f"MAV_MISSION_{verdict.ack.name}, {why}"
    dropped = sum(finding.becomes == DROPPED for finding in verdict.findings)
    changed = len(without_defaults(verdict.findings)) - dropped
    stored = f"{len(verdict.items)} of {sent} items stored, {dropped} dropped, values changed: {changed}"
    return f"{stored}; {', '.join(verdict.flight)}; {identify(verdict.records)}"
