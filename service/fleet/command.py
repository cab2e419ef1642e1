# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet`: its commands, and what they print."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import click
import zenoh
from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from protocols.mission_file import MissionFileError, read_mission_file, write_qgc_wpl
from service.cli.command_group import CommandGroup
from service.cli.mission_source import mission_bytes, save_mission
from service.cli.printing import fail, print_json, print_table
from service.fleet.fleet_table import complaints, fleet_table
from service.fleet.pull import Held, pull
from service.fleet.push import FleetPush, push
from service.fleet.push_table import progress_bars, push_data, push_summary, push_table
from service.fleet.roll_call import alive, chosen, roll_call
from service.fleet.session import DEFAULT_ENDPOINT, FleetAddress, FleetError, is_connected, open_session
from service.fleet.watch import Watch, watching
from service.zenoh_link.settings import ZenohSettings, ZenohSettingsError, check_name

_UNREADABLE = 2
_STANDARD_OUTPUT = Path("-")
_INTERRUPTED = 130
_REFRESH_S = 0.5
_PATH = click.Path(path_type=Path)

F = TypeVar("F", bound=Callable[..., Any])


def _address_options(command: F) -> F:
    """Add the options that say where the fleet is."""
    for option in (
        click.option("--config", type=_PATH, help="The daemon's configuration file: its [zenoh] table says the rest."),
        click.option("--prefix", help="First part of the vehicles' keys.", show_default="fleet"),
        click.option("--zenoh-config", type=_PATH, help="zenoh configuration file, for TLS, passwords and the like."),
        click.option(
            "--connect",
            metavar="ENDPOINT",
            multiple=True,
            show_default=DEFAULT_ENDPOINT,
            help="Router, or one vehicle that listens; of several the first that answers.",
        ),
    ):
        command = option(command)
    return command


_json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
_vehicle_option = click.option(
    "--vehicle", "names", metavar="NAME", multiple=True, help="This vehicle; several at once."
)


@click.group(cls=CommandGroup)
def fleet() -> None:
    """See and serve many vehicles at once, over Eclipse zenoh (docs/fleet.md)."""


@fleet.command("list")
@_address_options
@_json_option
def list_vehicles(as_json: bool, **where: Any) -> None:
    """Show who is alive, and how each one is.

    Exit code 0, also if nobody is; 1: the fleet cannot be reached.
    """
    with _session(where) as (session, prefix):
        found = roll_call(session, prefix)
    if as_json:
        print_json({"vehicles": [asdict(vehicle) for vehicle in found], "complaints": complaints(found)})
    elif found:
        print_table(fleet_table(found))
    else:
        click.echo(f"No vehicle is alive under {prefix!r}.")


@fleet.command()
@_address_options
def watch(**where: Any) -> None:
    """Show who is alive and how each one is, until Ctrl-C."""
    with (
        _session(where) as (session, prefix),
        watching(session, prefix) as seen,
        Live(console=Console(highlight=False), auto_refresh=False) as live,
    ):
        try:
            while True:
                live.update(_picture(seen, session, prefix), refresh=True)
                time.sleep(_REFRESH_S)
        except KeyboardInterrupt:
            return


@fleet.command("push")
@click.argument("file", type=_PATH)
@_vehicle_option
@click.option("--all", "to_all", is_flag=True, help="Every vehicle that is alive.")
@_address_options
@_json_option
def push_mission(file: Path, names: tuple[str, ...], to_all: bool, as_json: bool, **where: Any) -> None:
    """Write a mission file to vehicles, each by its own rules, and verify it there.

    A vehicle that fails does not stop the others. Exit code 0: all hold it, 1: one does not, 2: the file is unreadable.
    """
    if bool(names) == to_all:
        raise click.UsageError("say for whom the mission is: --vehicle NAME, or --all")
    try:
        mission = mission_bytes(file)
        item_count = len(read_mission_file(mission, click.format_filename(file)))
    except MissionFileError as error:
        click.echo(f"naze-bridge: {error}", err=True)
        raise SystemExit(_UNREADABLE) from error
    with _session(where) as (session, prefix):
        bridges = alive(session, prefix)
        delivery = FleetPush.of(chosen(bridges, names, prefix), bridges)
        try:
            with progress_bars(delivery, item_count) as show:
                push(session, prefix, delivery, bridges, mission, show)
        except KeyboardInterrupt:
            what = "stopped; what has begun goes on there: `naze-bridge fleet list` tells what each vehicle holds"
            click.echo(f"naze-bridge: {what}", err=True)
            raise SystemExit(_INTERRUPTED) from None
    if as_json:
        print_json(push_data(delivery))
    else:
        print_table(push_table(delivery))
        click.echo(push_summary(delivery))
    if delivery.failed:
        raise SystemExit(1)


@fleet.command("pull")
@click.argument("path", type=_PATH, required=False)
@_vehicle_option
@_address_options
@_json_option
def pull_missions(path: Path | None, names: tuple[str, ...], as_json: bool, **where: Any) -> None:
    """Fetch what the vehicles' flight controllers hold, of all that are alive or of those that are named.

    PATH is a folder, in which each vehicle's mission becomes NAME.waypoints; for one named vehicle it may be a file, or
    - for standard output. Without it the missions are shown. Exit code 0: all were told, 1: one was not, or cannot be
    written.
    """
    to_output = path == _STANDARD_OUTPUT
    if to_output and (len(names) != 1 or as_json):
        raise click.UsageError("standard output takes one mission: name one --vehicle, and leave --json away")
    with _session(where) as (session, prefix):
        bridges = alive(session, prefix)
        held = pull(session, prefix, chosen(bridges, names, prefix), bridges)
    for each in held:
        if each.error is None and to_output:
            click.echo(write_qgc_wpl(each.items), nl=False)
        elif each.error is None and path is not None:
            _save(each, path, is_file=len(names) == 1 and not path.is_dir())
        if not as_json:
            _show(each, with_items=path is None, to_error=to_output)
    if as_json:
        print_json({"vehicles": [asdict(each) for each in held]})
    if any(each.error for each in held):
        raise SystemExit(1)


def _save(held: Held, path: Path, *, is_file: bool) -> None:
    try:
        if not is_file:
            path.mkdir(parents=True, exist_ok=True)
        save_mission(path if is_file else path / f"{held.vehicle}.waypoints", write_qgc_wpl(held.items))
    except MissionFileError as error:
        fail(str(error))
    except OSError as error:
        fail(f"{click.format_filename(path)} is no folder that can be written: {(error.strerror or '').lower()}")


def _show(held: Held, *, with_items: bool, to_error: bool) -> None:
    if held.error is not None:
        click.echo(f"{held.vehicle}: {held.error}", err=True)
        return
    click.echo(f"{held.vehicle}: {held.count} records, checksum {held.checksum}", err=to_error)
    if with_items and held.items:
        # Here, because nothing else in the fleet's commands needs the names of MAVLink's commands.
        from service.cli.mission_table import mission_table

        print_table(mission_table(held.items, held.items, ()))


def _picture(seen: Watch, session: zenoh.Session, prefix: str) -> Group:
    fleet_now, ages_s = seen.look()
    if not is_connected(session):
        return Group(Text("The router is gone; waiting for it. Ctrl-C ends.", style="red"))
    if not fleet_now:
        return Group(Text(f"No vehicle is alive under {prefix!r}. Ctrl-C ends."))
    return Group(fleet_table(fleet_now, ages_s), Text("Ctrl-C ends.", style="dim"))


@contextmanager
def _session(where: dict[str, Any]) -> Iterator[tuple[zenoh.Session, str]]:
    """Join the fleet for one command; what cannot be done ends the program with one sentence, Ctrl-C with none."""
    address = _address(**where)
    try:
        with open_session(address) as session:
            yield session, address.prefix
    except FleetError as error:
        fail(str(error))
    except KeyboardInterrupt:
        raise SystemExit(_INTERRUPTED) from None


def _address(
    connect: tuple[str, ...], zenoh_config: Path | None, prefix: str | None, config: Path | None
) -> FleetAddress:
    """Put together where the fleet is: options over the daemon's file."""
    try:
        daemon = ZenohSettings() if config is None else _daemon_settings(config)
        address = FleetAddress(prefix or daemon.prefix, connect or daemon.connect, zenoh_config or daemon.config_file)
        check_name("prefix", address.prefix)
    except ZenohSettingsError as error:
        raise click.UsageError(str(error)) from error
    return address


def _daemon_settings(config: Path) -> ZenohSettings:
    # Here, because most commands do without them and without all that they load.
    from service.settings import SettingsError, load_settings

    try:
        # Its flight controller is none of our business, but a file need not name one.
        found = load_settings(config, "sim:", (), None).zenoh
    except SettingsError as error:
        raise ZenohSettingsError(str(error)) from error
    if found is None:
        raise ZenohSettingsError(f"{config} has no [zenoh] table")
    return found
