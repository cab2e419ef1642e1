# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge push`, `pull` and `clear`."""

import sys
from dataclasses import asdict
from pathlib import Path

import click

from bridge.missions.list_check import with_home
from payloads.mission_data import ACCEPTED, Json, mission_findings, mission_items
from protocols.mission_file import MissionFileError, write_mission_file, write_qgc_wpl
from service.cli.daemon_client import BridgeClient, bridge_options
from terminal.command_group import PATH, position
from terminal.files import load_mission, shown_path, write_file
from terminal.mission_table import mission_table
from terminal.printing import print_json, print_table
from terminal.sentences import UNREADABLE, fail, say

_NO_SPACE = "MAV_MISSION_NO_SPACE"
_WOULD_ERASE = 3
_STANDARD_OUTPUT = Path("-")


@click.command()
@click.argument("file", type=PATH)
@click.option("--home", metavar="LAT,LON", callback=position, help="Home, if the list has none.")
@click.option("--erase", is_flag=True, help="Erase without asking if no item of the file can be stored.")
@bridge_options
def push(client: BridgeClient, file: Path, home: tuple[int, int] | None, erase: bool) -> None:
    """Write a mission file to the flight controller and verify it there.

    Exit code 1: refused or failed, the old mission is kept; 3: no item of the file can be stored, and the mission was
    not erased.
    """
    try:
        items = with_home(load_mission(file, has_home=home is not None), home)
    except MissionFileError as error:
        fail(error, UNREADABLE)
    request: Json = {"do": "push", "items": [asdict(item) for item in items], "source": f"push of {file.name}"}
    delivery = client.ask_with_progress(request | {"may_erase": erase}, len(items))
    is_asked = _would_erase(delivery) and not client.as_json and sys.stdin.isatty()
    if is_asked and click.confirm(f"{delivery['text']}. Erase it?", err=True):
        delivery = client.ask_with_progress(request, len(items))
    show_delivery(client, delivery)


def _would_erase(delivery: Json) -> bool:
    return delivery.get("verdict") == "CLEARED" and delivery["ack"] != ACCEPTED


@click.command()
@click.argument("file", type=PATH, required=False)
@click.option("--all", "with_others", is_flag=True, help="Also read the missions in INAV's store that are not loaded.")
@bridge_options
def pull(client: BridgeClient, file: Path | None, with_others: bool) -> None:
    """Read the flight controller's mission, into FILE or as a table.

    FILE is written as QGC WPL 110, or as a QGroundControl plan if its name ends with .plan; - is standard output.

    With --all, further missions go to FILE-2, FILE-3 and so on.
    """
    if client.as_json and file == _STANDARD_OUTPUT:
        raise click.UsageError("the file and --json cannot both go to standard output: omit one of them")
    if with_others and file == _STANDARD_OUTPUT:
        raise click.UsageError("--all cannot write several missions to standard output: name a file")
    held = client.ask({"do": "pull"})
    others = held["others"] if with_others else []
    summaries = [_show_held(held, file, is_quiet=client.as_json)]
    for number, other in enumerate(others, 2):
        summaries.append(_show_held(other, file and file.with_stem(f"{file.stem}-{number}"), is_quiet=client.as_json))
    if client.as_json:
        print_json(held)
    elif file == _STANDARD_OUTPUT:
        click.echo(summaries[0], err=True)
    elif held["others"] and not with_others:
        click.echo(f"{summaries[0]}; {len(held['others'])} more in its store: see --all")
    else:
        click.echo("\n".join(summaries))


def _show_held(held: Json, file: Path | None, *, is_quiet: bool) -> str:
    """Write a mission to the file, or print the table; a summary."""
    items = mission_items(held["items"])
    summary = f"{held['count']} records, checksum {held['checksum']}"
    if file == _STANDARD_OUTPUT:
        click.echo(write_qgc_wpl(items), nl=False)
    elif file is not None:
        try:
            write_file(file, write_mission_file(items, file.name), MissionFileError)
        except MissionFileError as error:
            fail(error)
        summary += f", written to {shown_path(file)}"
    elif items and not is_quiet:
        print_table(mission_table(items, items, ()))
    return summary


@click.command()
@bridge_options
def clear(client: BridgeClient) -> None:
    """Clear the mission on the flight controller and verify the result."""
    show_delivery(client, client.ask({"do": "push", "items": [], "source": "clear"}))


def _print_delivery(delivery: Json) -> None:
    if delivery.get("sent") and delivery["ack"] != _NO_SPACE:
        sent, stored = (mission_items(delivery[key]) for key in ("sent", "stored"))
        findings = mission_findings(delivery["findings"])
        print_table(mission_table(sent, stored, findings, delivery["sent_seqs"]))
    say(f"{delivery['ack'].removeprefix('MAV_MISSION_')}: {delivery['text']}")


def show_delivery(client: BridgeClient, delivery: Json) -> None:
    """Print the list as sent and as held. Ends the program with status 1 or 3 if it was not accepted."""
    client.show(delivery, lambda: _print_delivery(delivery))
    if _would_erase(delivery):
        raise SystemExit(_WOULD_ERASE)
    if delivery["ack"] != ACCEPTED:
        raise SystemExit(1)
