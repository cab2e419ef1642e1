# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge signing`: the times of MAVLink's signatures."""

import click

from service.cli.daemon_client import BridgeClient, daemon_options
from terminal.command_group import CommandGroup
from terminal.sentences import say


@click.group(cls=CommandGroup)
def signing() -> None:
    """Accept ground stations again after a wrong clock.

    A signature has a time: one that is over a minute behind the bridge's, or over a day ahead, is refused.
    """


@signing.command()
@daemon_options
def reset(client: BridgeClient) -> None:
    """Forget the times of all ground stations, and believe the next one with the key."""
    done = client.ask({"do": "reset-signing"})
    client.show(done, lambda: say(done["text"]))
