# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet logs`: a vehicle's telemetry logs over the uplink, in pieces: an interrupted fetch continues."""

import base64
import json
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import zenoh

from fleet.options import address_options, fleet_session, json_option, vehicle_option
from fleet.payload import objects, text, whole
from fleet.roll_call import alive, chosen
from fleet.session import NO_COMMANDS, FleetError, answer_of, ask_each
from payloads.keys import LOG_LIST, LOG_READ
from storage.os_error import reason
from terminal.command_group import PATH
from terminal.printing import print_json
from terminal.sentences import complain, fail, say

_TIMEOUT_S = 30.0
#: A bridge's pieces have 64 kB, and MAVLink halves when packed. A bridge that lies must not fill this disk quickly.
_MOST_BYTES, _MOST_PACKED, _MOST_SIZE = 1 << 16, 10, 1 << 32


@dataclass(frozen=True, slots=True)
class Log:
    """A log on a vehicle; `size` in bytes."""

    vehicle: str
    name: str
    size: int


def list_logs(session: zenoh.Session, prefix: str, names: Sequence[str]) -> tuple[dict[str, list[Log]], dict[str, str]]:
    """The logs by vehicle, newest first, and by vehicle why they are not known."""
    found: dict[str, list[Log]] = {}
    errors: dict[str, str | None] = dict.fromkeys(names, NO_COMMANDS)
    for name, reply in ask_each(session, prefix, names, LOG_LIST.suffix, _TIMEOUT_S):
        if reply is not None:
            result, errors[name] = answer_of(reply)
            logs = [(text(each, "name"), whole(each, "size")) for each in objects(result or {}, "logs")]
            found[name] = [Log(name, log, size) for log, size in logs if log and size is not None and size < _MOST_SIZE]
    return found, {name: error for name, error in errors.items() if error is not None}


def fetch_log(
    session: zenoh.Session,
    prefix: str,
    log: Log,
    path: Path,
    rate_b_s: float,
    show: Callable[[int], object],
) -> None:
    """Fetch a log into `path`, at most `rate_b_s` bytes a second over the link; FleetError, OSError.

    Until it is whole it is called NAME.part, and a fetch continues there. `show` gets the size of each piece.
    """
    partial = path.with_name(f"{path.name}.part")
    with partial.open("ab") as file:
        show(file.tell())
        while file.tell() < log.size:
            began_at = time.monotonic()
            piece, cost = _piece(session, prefix, log, file.tell())
            file.write(piece)
            file.flush()
            show(len(piece))
            time.sleep(max(0.0, began_at + cost / rate_b_s - time.monotonic()))
    partial.rename(path)


def _piece(session: zenoh.Session, prefix: str, log: Log, start: int) -> tuple[bytes, int]:
    """The piece of a log from `start`, and the size on the link."""
    request = json.dumps({"name": log.name, "start": start}).encode()
    replies = ask_each(session, prefix, [log.vehicle], LOG_READ.suffix, _TIMEOUT_S, request)
    reply = next((each for _, each in replies if each is not None), None)
    result, error = (None, NO_COMMANDS) if reply is None else answer_of(reply)
    if result is None:
        raise FleetError(f"{log.vehicle}: {error}")
    data = str(result.get("data"))
    try:
        piece = zlib.decompressobj().decompress(base64.b64decode(data, validate=True), _MOST_BYTES)
    except (TypeError, ValueError, zlib.error) as error:
        raise FleetError("this version does not understand the reply") from error
    if whole(result, "start") != start or not piece:
        raise FleetError("the log has become shorter: fetch it again")
    return piece, max(len(data), len(piece) // _MOST_PACKED)


@click.command("logs", short_help="List and fetch vehicles' telemetry logs.")
@vehicle_option
@click.argument("logs", metavar="[LOG]...", nargs=-1)
@click.option("--folder", type=PATH, default=Path(), help="Folder to save them in; by default the current one.")
@click.option(
    "--rate", type=click.FloatRange(1), default=20.0, show_default=True, help="The maximum rate over the link, kB/s."
)
@address_options
@json_option
def fleet_logs(
    names: tuple[str, ...], logs: tuple[str, ...], folder: Path, rate: float, as_json: bool, **where: Any
) -> None:
    """List the telemetry logs of all vehicles, or of those named, or fetch one vehicle's LOGs.

    The vehicles must accept commands. A fetch that was interrupted continues where it stopped: run it again. Each log
    becomes a file whose name begins with the vehicle's.
    """
    if logs and len(names) != 1:
        raise click.UsageError("logs are fetched from one vehicle: name it with one --vehicle")
    with fleet_session(where) as (session, prefix):
        meant = chosen(alive(session, prefix), names, prefix)
        found, errors = list_logs(session, prefix, meant)
        if errors and logs:
            raise FleetError(f"{meant[0]}: {errors[meant[0]]}")
        known = {log.name: log for log in found[meant[0]]} if logs else {}
        for name in logs:
            if name not in known or Path(name).name != name:
                fail(f"{meant[0]} has no log {name!r}: `naze-bridge fleet logs --vehicle {meant[0]}` lists them")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for name in logs:
                with click.progressbar(length=known[name].size, label=name) as bar:
                    fetch_log(session, prefix, known[name], folder / f"{meant[0]} {name}", rate * 1000, bar.update)
        except OSError as error:
            fail(f"{folder} cannot be written: {reason(error)}")
    if logs:
        return
    if as_json:
        print_json({"logs": [asdict(log) for each in found.values() for log in each], "errors": errors})
    else:
        for vehicle, each in found.items():
            for log in each:
                click.echo(f"{vehicle}: {log.name}  {log.size / 1000:,.0f} kB")
            if not each and vehicle not in errors:
                say(f"{vehicle} has no telemetry logs", to_error=True)
        for vehicle, why in errors.items():
            complain(f"{vehicle}: {why}")
    if errors:
        raise SystemExit(1)
