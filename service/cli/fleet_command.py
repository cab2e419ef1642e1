# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet` with the command that needs the service: links to ground stations."""

import asyncio
from typing import Any

import click

from fleet.command import fleet
from fleet.options import address_options, all_option, fleet_session, vehicle_option
from fleet.push_command import require_choice
from fleet.roll_call import alive, chosen
from terminal.sentences import INTERRUPTED, fail


@fleet.command(short_help="Connect a ground station with vehicles, until Ctrl-C.")
@vehicle_option
@all_option
@click.option(
    "--gcs",
    metavar="ADDRESS",
    multiple=True,
    default=("udpout:127.0.0.1:14550",),
    show_default=True,
    help="The ground station, as for `run`; may be repeated.",
)
@address_options
def mavlink(names: tuple[str, ...], to_all: bool, gcs: tuple[str, ...], **where: Any) -> None:
    """Connect a ground station (Mission Planner, QGroundControl) with vehicles through zenoh, until Ctrl-C.

    The vehicles must accept MAVLink (mavlink_in = true in their [zenoh] table). Otherwise the station can only watch.
    Several vehicles need different system ids: `fleet enroll` assigns them. With --all the station also gets vehicles
    that appear later.
    """
    # Imported here, because the other commands do not need them.
    from service.cli.fleet_relay import relay_fleet
    from service.links.gcs_links import LinkError
    from service.settings.addresses import parse_gcs

    require_choice(names, to_all)
    try:
        addresses = [parse_gcs(address) for address in gcs]
    except ValueError as error:
        raise click.UsageError(str(error)) from None

    with fleet_session(where) as (session, prefix):
        bridges = alive(session, prefix)
        vehicles = chosen(bridges, names, prefix)
        try:
            asyncio.run(relay_fleet(session, prefix, vehicles, bridges, addresses, is_all=to_all))
        except LinkError as error:
            fail(error)
        except KeyboardInterrupt:
            raise SystemExit(INTERRUPTED) from None
