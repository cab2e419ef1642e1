# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet logs`: a vehicle's telemetry logs over the uplink."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from fleet.logs import fetch_log, list_logs
from fleet.options import address_options, fleet_session, json_option
from fleet.roll_call import alive, chosen
from storage.os_error import reason
from terminal.options import PATH
from terminal.printing import print_json
from terminal.sentences import fail, say


@click.command("logs", short_help="List and fetch a vehicle's telemetry logs.")
@click.argument("vehicle")
@click.argument("names", metavar="[LOG]...", nargs=-1)
@click.option("--folder", type=PATH, default=Path(), help="Folder to save them in; by default the current one.")
@click.option(
    "--rate", type=click.FloatRange(1), default=20.0, show_default=True, help="The maximum rate over the link, kB/s."
)
@address_options
@json_option
def fleet_logs(vehicle: str, names: tuple[str, ...], folder: Path, rate: float, as_json: bool, **where: Any) -> None:
    """List a vehicle's telemetry logs, or fetch those named.

    The vehicle must accept commands. A fetch that was interrupted continues where it stopped: run it again. Each log
    becomes a file whose name begins with the vehicle's.
    """
    with fleet_session(where) as (session, prefix):
        chosen(alive(session, prefix), (vehicle,), prefix)
        logs = {log.name: log for log in list_logs(session, prefix, vehicle)}
        for name in names:
            if name not in logs or Path(name).name != name:
                fail(f"{vehicle} has no log {name!r}: `naze-bridge fleet logs {vehicle}` lists them")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for name in names:
                with click.progressbar(length=logs[name].size, label=name) as bar:
                    fetch_log(
                        session,
                        prefix,
                        vehicle,
                        logs[name],
                        folder / f"{vehicle} {name}",
                        rate * 1000,
                        lambda size, bar=bar: bar.update(size - bar.pos),  # type: ignore[misc]
                    )
        except OSError as error:
            fail(f"{folder} cannot be written: {reason(error)}")
    if names:
        return
    if as_json:
        print_json({"logs": [asdict(log) for log in logs.values()]})
        return
    for log in logs.values():
        click.echo(f"{log.name}  {log.size / 1000:,.0f} kB")
    if not logs:
        say(f"{vehicle} has no telemetry logs", to_error=True)
