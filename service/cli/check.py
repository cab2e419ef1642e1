# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge check`: what would become of a mission file, offline."""

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any

import click

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M, USUAL_CAPACITY, USUAL_WP_RADIUS_CM
from bridge.controllers.nav.rules import INAV_CAPACITY, MULTIWII_CAPACITY
from bridge.controllers.table import PROFILES
from bridge.fc.profile import RuleSettings
from bridge.missions.list_check import MissionRules, check_list
from bridge.model.finding import DROPPED
from bridge.model.verdict import Result, Verdict
from protocols.mission_file import MissionFileError
from protocols.mission_item import MissionItem
from protocols.mission_record import identify
from service.cli.mission_source import load_mission
from service.cli.mission_table import mission_table
from service.cli.printing import print_json, print_table
from service.mission_data import verdict_data

#: The rules of each flight controller that stores missions.
_RULES: Mapping[str, Callable[[RuleSettings], MissionRules]] = {
    profile.check_kind: profile.rules for profile in PROFILES if profile.check_kind and profile.rules
}


class ExitCode(IntEnum):
    """The answer to a script; of several files the worst one's."""

    ACCEPTED = 0
    REJECTED = 1
    UNREADABLE = 2


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FILE...")
@click.option("--strict", is_flag=True, help="Changed values and dropped items count as rejection (exit code 1).")
@click.option("--kind", type=click.Choice(list(_RULES)), default="harakiri", show_default=True, help="Whose rules.")
@click.option(
    "--wp-radius-cm",
    type=click.IntRange(0, 2000),
    default=USUAL_WP_RADIUS_CM,
    show_default=True,
    help="Harakiri's gps_wp_radius.",
)
@click.option(
    "--capacity",
    type=click.IntRange(2, 65535),
    help=f"Records that it holds; without: Harakiri {USUAL_CAPACITY}, home included, INAV {INAV_CAPACITY}, "
    f"MultiWii {MULTIWII_CAPACITY}.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object a line for each file.")
@click.pass_context
def check(
    ctx: click.Context,
    files: Sequence[Path],
    strict: bool,
    kind: str,
    wp_radius_cm: int,
    capacity: int | None,
    as_json: bool,
) -> None:
    """Show what would become of mission files (QGC WPL 110, QGroundControl .plan) on the flight controller.

    Nothing is sent anywhere. Exit code 0: every file would be accepted, 1: one would be rejected, 2: one is unreadable.
    """
    rules = _RULES[kind](RuleSettings(TAKEOFF_MAX_M, wp_radius_cm, capacity))
    ctx.exit(max(_check_file(path, rules, strict, as_json) for path in files))


def _check_file(path: Path, rules: MissionRules, strict: bool, as_json: bool) -> ExitCode:
    name = click.format_filename(path)
    try:
        sent = load_mission(path)
    except MissionFileError as error:
        if as_json:
            print_json({"file": name, "error": str(error)})
        else:
            click.echo(f"naze-bridge: {error}", err=True)
        return ExitCode.UNREADABLE
    verdict = check_list(sent, rules)
    if as_json:
        print_json({"file": name, **verdict_data(verdict)})
    else:
        _print_verdict(name, sent, verdict)
    rejected = verdict.result is Result.REJECTED or (strict and bool(verdict.findings))
    return ExitCode.REJECTED if rejected else ExitCode.ACCEPTED


def _print_verdict(name: str, sent: Sequence[MissionItem], verdict: Verdict[Any]) -> None:
    click.secho(name, bold=True)
    print_table(mission_table(sent, verdict.items, verdict.findings))
    click.echo(f"{verdict.result.name}: {_summary(len(sent), verdict)}\n")


def _summary(sent: int, verdict: Verdict[Any]) -> str:
    if verdict.result is not Result.ACCEPTED:
        return f"MAV_MISSION_{verdict.ack.name}, {verdict.findings[-1].text()}"
    dropped = sum(finding.becomes == DROPPED for finding in verdict.findings)
    changed = len(verdict.findings) - dropped
    stored = f"{len(verdict.items)} of {sent} items stored, {dropped} dropped, values changed: {changed}"
    return f"{stored}; {identify(verdict.records)}"
