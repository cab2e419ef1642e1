# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts common to all fleet commands: the fleet's address, the choice of vehicles, and the session."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import click
import zenoh

from fleet.session import DEFAULT_ENDPOINT, FleetError, open_session
from payloads.names import DEFAULT_PREFIX, ZenohSettingsError, check_name
from terminal.command_group import PATH
from terminal.sentences import INTERRUPTED, fail

F = TypeVar("F", bound=Callable[..., Any])


def check_endpoint(_context: click.Context, option: click.Parameter, value: Any) -> Any:
    """An option's callback: BadParameter if an endpoint does not have zenoh's form."""
    for endpoint in value if option.multiple else [value]:
        if re.fullmatch(r"[a-z]+/.+:[0-9]+", endpoint) is None:
            raise click.BadParameter(f"{endpoint!r} is not an endpoint: write one like {DEFAULT_ENDPOINT}")
    return value


def address_options(command: F) -> F:
    for option in (
        click.option("--prefix", help="First part of the vehicles' keys.", default=DEFAULT_PREFIX, show_default=True),
        click.option("--zenoh-config", type=PATH, help="zenoh configuration file, for TLS, passwords and the like."),
        click.option(
            "--connect",
            callback=check_endpoint,
            metavar="ENDPOINT",
            multiple=True,
            show_default=DEFAULT_ENDPOINT,
            help="Router, or one vehicle that listens; of several, the first that answers is used.",
        ),
    ):
        command = option(command)
    return command


json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
vehicle_option = click.option(
    "--vehicle", "names", metavar="NAME", multiple=True, help="Only this vehicle; may be repeated."
)
all_option = click.option("--all", "to_all", is_flag=True, help="Every vehicle that is alive.")


def vehicles_options(command: F) -> F:
    """--vehicle and --all."""
    return vehicle_option(all_option(command))


staged_option = click.option(
    "--staged",
    is_flag=True,
    help="One vehicle first, then 1, 2, 4, 8 and so on; stop at the first failure. Run it again to continue.",
)


@contextmanager
def fleet_session(where: dict[str, Any]) -> Iterator[tuple[zenoh.Session, str]]:
    """Join the fleet for one command. An error ends the program with one sentence, Ctrl-C silently.

    `where`: the options for the fleet's address.
    """
    try:
        prefix = check_name("--prefix", where["prefix"])
    except ZenohSettingsError as error:
        raise click.UsageError(str(error)) from error
    try:
        with open_session(where["connect"], where["zenoh_config"]) as session:
            yield session, prefix
    except FleetError as error:
        fail(error)
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
