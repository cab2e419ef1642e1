# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet enroll` and `fleet expel`: a member's login, and its rights in the router's configuration."""

from pathlib import Path

import click

from fleet.enrolment import SYSIDS, EnrolmentError, FleetFolder, FleetRouter, Role
from fleet.options import check_endpoint
from payloads.names import DEFAULT_PREFIX, ZenohSettingsError
from terminal.command_group import PATH
from terminal.sentences import fail

_folder_option = click.option(
    "--folder", type=PATH, default=Path("fleet"), show_default=True, help="Folder of the fleet's files."
)


@click.command(short_help="Add a vehicle or a person to a fleet.")
@click.argument("name")
@click.option(
    "--role",
    type=click.Choice([each.value for each in Role if each is not Role.EXPELLED]),
    default=Role.VEHICLE.value,
    show_default=True,
    help="A vehicle publishes only under its own name, a pilot may do everything, a guest only watch.",
)
@_folder_option
@click.option("--prefix", default=DEFAULT_PREFIX, show_default=True, help="First part of the vehicles' keys.")
@click.option(
    "--router",
    callback=check_endpoint,
    default="tcp/router.local:7447",
    show_default=True,
    metavar="ENDPOINT",
    help="The router's address for members: tls/... for certificates, tcp/... for passwords.",
)
def enroll(name: str, role: str, folder: Path, prefix: str, router: str) -> None:
    """Add a vehicle or a person to a fleet: makes the login and the router's access control.

    Restart the router afterwards: it reads both only at the start. A name enrolled again keeps the login.
    """
    fleet, way_in = FleetFolder(folder.absolute()), FleetRouter(router, prefix)
    try:
        enrolled = fleet.enroll(name, Role(role), way_in)
    except ZenohSettingsError as error:
        raise click.UsageError(str(error)) from error
    except EnrolmentError as error:
        fail(error)
    click.echo(f"Copy into one folder of {name}: {', '.join(map(str, enrolled.files))}")
    if role == Role.VEHICLE.value:
        sysid = "" if enrolled.member.sysid is None else f"sysid = {enrolled.member.sysid}\n\n"
        table = f'[zenoh]\nvehicle = "{name}"\nconfig_file = "{enrolled.files[0].name}"'
        table += "\n# For pilots to push missions and settings, and to fetch logs:\n# commands = true"
        click.echo(f"In its configuration file:\n\n{sysid}{table}")
        if not sysid:
            click.echo(f"\nAll {len(SYSIDS)} system ids are in use: it does not get one.")
    if way_in.is_tls:
        click.echo(f"\nCertificates: python make_certificates.py {folder} ROUTER_HOST {name} (examples/zenoh-tls)")
    click.echo(f"\nThen restart the router in {fleet.path} with router.json5.")


@click.command(short_help="Remove a vehicle or a person from a fleet.")
@click.argument("name")
@_folder_option
def expel(name: str, folder: Path) -> None:
    """Remove a vehicle or a person from a fleet: the rights, and the password if it has one.

    Restart the router afterwards: until then the present sessions and the login still work. A certificate stays valid,
    but without rights, so the name of a member with a certificate cannot be enrolled again.
    """
    fleet = FleetFolder(folder.absolute())
    try:
        fleet.expel(name)
    except EnrolmentError as error:
        fail(error)
    click.echo(f"{name} has been expelled.\n\nNow restart the router in {fleet.path} with router.json5.")
    click.echo(f"Until then {name}'s sessions continue, and new ones can be opened.")
