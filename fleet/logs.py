# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry logs of a vehicle, fetched in pieces: an interrupted fetch continues where it stopped."""

import base64
import binascii
import json
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import zenoh

from fleet.payload import decode, part, text, whole
from fleet.session import NO_COMMANDS, FleetError, ask_each
from payloads.keys import LOG_LIST, LOG_READ, ZenohKey
from payloads.mission_data import Json

_TIMEOUT_S = 30.0
#: The limit for a piece; a bridge sends 64 kB.
_MOST_BYTES = 1 << 20
#: After a piece without a reply, for example because the link is down.
_TRIES, _PAUSE_S = 5, 2.0


@dataclass(frozen=True, slots=True)
class Log:
    """A log on the vehicle; `size` in bytes."""

    name: str
    size: int


def list_logs(session: zenoh.Session, prefix: str, vehicle: str) -> list[Log]:
    """Newest first; FleetError."""
    result = _ask(session, prefix, vehicle, LOG_LIST, None)
    found = part(result, "logs")
    logs = [(text(each, "name"), whole(each, "size")) for each in found if isinstance(each, dict)] if found else []
    return [Log(name, size) for name, size in logs if name is not None and size is not None]


def fetch_log(
    session: zenoh.Session,
    prefix: str,
    vehicle: str,
    log: Log,
    path: Path,
    rate_b_s: float,
    show: Callable[[int], object],
) -> None:
    """Fetch a log into `path`, at most `rate_b_s` bytes a second over the link; FleetError, OSError.

    Until it is whole it is called NAME.part; a fetch continues at the end of that file. `show` gets its size.
    """
    partial = path.with_name(f"{path.name}.part")
    with partial.open("ab") as file:
        while file.tell() < log.size:
            began_at = time.monotonic()
            request = json.dumps({"name": log.name, "start": file.tell()}).encode()
            piece, cost = _piece(_again(session, prefix, vehicle, request), file.tell())
            file.write(piece)
            file.flush()
            show(file.tell())
            time.sleep(max(0.0, began_at + cost / rate_b_s - time.monotonic()))
    partial.rename(path)


def _again(session: zenoh.Session, prefix: str, vehicle: str, request: bytes) -> Json:
    for attempt in range(_TRIES):
        try:
            return _ask(session, prefix, vehicle, LOG_READ, request)
        except NoReply:
            if attempt == _TRIES - 1:
                raise
            time.sleep(_PAUSE_S)
    raise AssertionError


def _piece(result: Json, start: int) -> tuple[bytes, int]:
    """The piece of a log, and its size on the link."""
    data = text(result, "data") or ""
    try:
        piece = zlib.decompressobj().decompress(base64.b64decode(data, validate=True), _MOST_BYTES)
    except (binascii.Error, zlib.error) as error:
        raise FleetError("this version does not understand the reply") from error
    if whole(result, "start") != start or not piece:
        raise FleetError("the log has become shorter: fetch it again")
    return piece, len(data)


class NoReply(FleetError):
    """The vehicle did not reply."""


def _ask(session: zenoh.Session, prefix: str, vehicle: str, key: ZenohKey, payload: bytes | None) -> Json:
    for _, reply in ask_each(session, prefix, [vehicle], key.suffix, _TIMEOUT_S, payload):
        if reply is None:
            break
        data = decode(reply.ok or reply.err) or {}  # type: ignore[arg-type]
        if reply.ok is None and text(data, "error"):
            raise FleetError(f"{vehicle}: {text(data, 'error')}")
        result = part(data, "result")
        if isinstance(result, dict):
            return result
    raise NoReply(f"{vehicle} {NO_COMMANDS}")
