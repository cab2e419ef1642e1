# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge signing`: the times of MAVLink's signatures."""

import click

from service.cli.daemon_client import BridgeClient, daemon_options
from terminal.command_group import CommandGroup
from terminal.sentences import say


@click.group(cls=CommandGroup)
def signing() -> None:
    """Accept ground stations again after a wrong clock.

    Signatures carry a time, and are refused if it is over a minute behind the bridge's clock, or over a day ahead.
    """


@signing.command()
@daemon_options
def reset(client: BridgeClient) -> None:
    """Forget the times of all ground stations, and accept that of the next station with the key."""
    done = client.ask({"do": "reset-signing"})
    client.show(done, lambda: say(done["text"]))
