"""`naze-bridge missions`: what came in, and what became of it."""

import difflib
import json
from datetime import datetime
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from bridge.finding import Finding
from protocols.mission_file import write_qgc_wpl
from protocols.mission_item import MissionItem
from service.asking import ask, ask_with_progress, bridge_options
from service.control import Json
from service.mission_commands import show_delivery
from service.mission_table import mission_table


@click.group()
def missions() -> None:
    """Look at missions that came in, accepted or not, and restore one."""


@missions.command("list")
@click.option("--limit", type=click.IntRange(1), default=20, show_default=True, help="Newest first, so many.")
@bridge_options
def list_missions(limit: int, state_dir: Path, fc: str | None, as_json: bool) -> None:
    """List the missions that came in, newest first."""
    found = ask(state_dir, fc, {"do": "missions", "limit": limit})["missions"]
    if as_json:
        click.echo(json.dumps(found))
        return
    table = Table("No.", "Received", "From", "Items", "Changes", "Verdict", "Outcome", "Detail", box=None)
    for mission in found:
        counts = (str(mission["item_count"]), str(mission["finding_count"]))
        when = _local_time(mission["received_at"])
        ending = (mission["verdict"], mission["outcome"], mission["detail"])
        table.add_row(str(mission["number"]), when, mission["source"], *counts, *ending)
    Console(highlight=False).print(table)


@missions.command()
@click.argument("number", type=int)
@bridge_options
def show(number: int, state_dir: Path, fc: str | None, as_json: bool) -> None:
    """Show mission NUMBER: as sent beside as stored, and why."""
    mission = _fetch(state_dir, fc, number)
    if as_json:
        click.echo(json.dumps(mission))
        return
    received = mission["received"]
    findings = [Finding(**finding) for finding in received["findings"]]
    table = mission_table(_items(received["items"]), _items(received["stored_items"]), findings)
    Console(highlight=False).print(table)
    click.echo(f"{_local_time(received['received_at'])} from {received['source']}")
    click.echo(f"{received['verdict']} ({received['ack']}), {mission['outcome']}: {mission['detail']}")


@missions.command()
@click.argument("first", type=int)
@click.argument("second", type=int)
@bridge_options
def diff(first: int, second: int, state_dir: Path, fc: str | None, as_json: bool) -> None:
    """Compare missions FIRST and SECOND as sent. Exit code 1 if they differ."""
    before, after = (
        write_qgc_wpl(_items(_fetch(state_dir, fc, number)["received"]["items"])).splitlines()
        for number in (first, second)
    )
    lines = list(difflib.unified_diff(before, after, f"mission {first}", f"mission {second}", lineterm=""))
    if as_json:
        click.echo(json.dumps({"equal": not lines, "diff": lines}))
    else:
        click.echo("\n".join(lines) or "no difference")
    if lines:
        raise SystemExit(1)


@missions.command()
@click.argument("number", type=int)
@bridge_options
def restore(number: int, state_dir: Path, fc: str | None, as_json: bool) -> None:
    """Write mission NUMBER to the flight controller again, as it was sent then."""
    count = len(_fetch(state_dir, fc, number)["received"]["items"])
    request = {"do": "restore", "number": number}
    show_delivery(ask_with_progress(state_dir, fc, request, count), as_json=as_json)


def _fetch(state_dir: Path, fc: str | None, number: int) -> Json:
    return ask(state_dir, fc, {"do": "mission", "number": number})


def _items(dictionaries: list[Json]) -> list[MissionItem]:
    return [MissionItem(**item) for item in dictionaries]


def _local_time(unix_s: float) -> str:
    return datetime.fromtimestamp(unix_s).astimezone().strftime("%Y-%m-%d %H:%M:%S")
