# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge missions`: the received missions and their results."""

from datetime import datetime

import click
from rich.table import Column, Table
from rich.text import Text

from payloads.mission_data import MOST, Json, mission_findings, mission_items
from service.cli.daemon_client import BridgeClient, daemon_options
from service.cli.mission_commands import show_delivery
from terminal.command_group import CommandGroup
from terminal.mission_table import mission_table
from terminal.printing import print_json, print_table
from terminal.sentences import say

_NUMBER = click.IntRange(1, MOST)


@click.group(cls=CommandGroup)
def missions() -> None:
    """List, show and restore the received missions, accepted or not."""


@missions.command("list")
@click.option("--limit", type=_NUMBER, default=20, show_default=True, help="The maximum number of missions.")
@daemon_options
def list_missions(client: BridgeClient, limit: int) -> None:
    """List the received missions, newest first."""
    found = client.ask({"do": "missions", "limit": limit})["missions"]
    if client.as_json:
        print_json(found)
        return
    if not found:
        click.echo("No mission has been received yet.")
        return
    details = Column("From, and details", overflow="fold")
    table = Table("No.", "Received", "Items", "Changes", "Outcome", details, box=None, pad_edge=False)
    for mission in found:
        counts = (str(mission["item_count"]), str(mission["finding_count"]))
        when = _local_time(mission["received_at"])
        text = Text("\n".join(filter(None, (mission["source"], mission["detail"]))))
        table.add_row(str(mission["number"]), when, *counts, mission["outcome"], text)
    print_table(table)


@missions.command()
@click.argument("number", type=_NUMBER)
@daemon_options
def show(client: BridgeClient, number: int) -> None:
    """Show mission NUMBER as sent and as stored, with the reasons."""
    mission = _fetch(client, number)
    if client.as_json:
        print_json(mission)
        return
    received = mission["received"]
    findings = mission_findings(received["findings"])
    sent, stored = mission_items(received["items"]), mission_items(received["stored_items"])
    print_table(mission_table(sent, stored, findings, received["sent_seqs"]))
    click.echo(f"{_local_time(received['received_at'])} from {received['source']}")
    say(f"{received['verdict']} ({received['ack']}), {mission['outcome']}: {mission['detail']}")


@missions.command(short_help="Write mission NUMBER to the flight controller again.")
@click.argument("number", type=_NUMBER)
@daemon_options
def restore(client: BridgeClient, number: int) -> None:
    """Write mission NUMBER to the flight controller again, as originally sent."""
    count = len(_fetch(client, number)["received"]["items"])
    show_delivery(client, client.ask_with_progress({"do": "restore", "number": number}, count))


def _fetch(client: BridgeClient, number: int) -> Json:
    return client.ask({"do": "mission", "number": number})


def _local_time(unix_s: float) -> str:
    return datetime.fromtimestamp(unix_s).astimezone().strftime("%Y-%m-%d %H:%M")
