# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet` with its parts that need the service: a daemon's settings, and links to ground stations."""

import asyncio
from pathlib import Path
from typing import Any

import click

from fleet.command import fleet
from fleet.options import FleetAddress, address_options, fleet_session
from fleet.roll_call import alive, chosen
from payloads.names import ZenohSettingsError
from terminal.sentences import INTERRUPTED, fail

_READ_ONLY = "accepts no MAVLink: zenoh.mavlink_in is off there, the router denies access, or it is not connected"


def _daemon_address(config: Path) -> FleetAddress:
    from service.settings import SettingsError, load_settings

    try:
        # The flight controller does not matter here, and a file need not name one.
        found = load_settings(config, "sim:", (), None).zenoh
    except SettingsError as error:
        raise ZenohSettingsError(str(error)) from error
    if found is None:
        raise ZenohSettingsError(f"{config} has no [zenoh] table")
    return FleetAddress(found.prefix, found.connect, found.config_file)


fleet.context_settings["obj"] = _daemon_address


@fleet.command(short_help="Connect a ground station with one vehicle, until Ctrl-C.")
@click.option("--vehicle", "name", metavar="NAME", required=True, help="The vehicle to connect with.")
@click.option(
    "--gcs",
    metavar="ADDRESS",
    multiple=True,
    default=("udpout:127.0.0.1:14550",),
    show_default=True,
    help="The ground station, as for `run`; may be repeated.",
)
@address_options
def mavlink(name: str, gcs: tuple[str, ...], **where: Any) -> None:
    """Connect a ground station (Mission Planner, QGroundControl) with one vehicle through zenoh, until Ctrl-C.

    The vehicle must accept MAVLink (mavlink_in = true in its [zenoh] table); otherwise the station can only watch.
    """
    # Imported here, because the other commands do not need them.
    from service.cli.gcs_relay import GcsRelay
    from service.links.gcs_links import LinkError
    from service.settings.addresses import parse_gcs

    try:
        addresses = [parse_gcs(address) for address in gcs]
    except ValueError as error:
        raise click.UsageError(str(error)) from None

    with fleet_session(where) as (session, prefix):
        bridges = alive(session, prefix)
        chosen(bridges, (name,), prefix)

        def input_changed(accepts: bool) -> None:
            click.echo(f"{name} {'accepts MAVLink again' if accepts else _READ_ONLY}", err=True)

        async def relay() -> None:
            relay = GcsRelay(session, prefix, name, addresses, input_changed, bridges)
            click.echo(f"{name} is at {', '.join(gcs)}. Ctrl-C ends.")
            try:
                await asyncio.Event().wait()
            finally:
                relay.close()

        try:
            asyncio.run(relay())
        except LinkError as error:
            fail(str(error))
        except KeyboardInterrupt:
            raise SystemExit(INTERRUPTED) from None
