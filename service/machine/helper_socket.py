# SPDX-License-Identifier: GPL-3.0-or-later
"""The root helper's sockets, from the daemon's side: one connection for one action (service.cli.helper)."""

import asyncio
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from payloads.mission_data import Json, to_json

#: A doctor on a Pi Zero takes 10 s. apt compares all packages before it accepts one.
_REPLY_TIMEOUT_S = 120.0
_MAX_REPLY = 1 << 20
#: The actions by the unit that carries them out: each has its own socket and privileges (systemd/).
UNITS: Mapping[str, Sequence[str]] = {
    "look": ("overview", "doctor"),
    "change": ("fix", "answer", "settings"),
    "update": ("install", "downgrade"),
}
#: The largest update, bytes.
MAX_PACKAGE = 128 << 20


class HelperError(Exception):
    """The helper refused, failed, or is not there, in one sentence."""


def unit_of(action: object) -> str | None:
    """The unit for an action, or None if there is no such action."""
    return next((unit for unit, actions in UNITS.items() if action in actions), None)


async def ask_helper(request: Json, body: Iterable[bytes] = ()) -> Json:
    """Send a request, followed by its body. Returns the reply. HelperError if the helper did not carry it out."""
    runtime = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    if not runtime:
        raise HelperError("This works only for the service: sudo systemctl start naze-bridge")
    name = f"naze-bridge-helper-{unit_of(request['action'])}"
    path = Path(runtime).with_name(f"{name}.sock")
    try:
        async with asyncio.timeout(_REPLY_TIMEOUT_S):
            reader, writer = await asyncio.open_unix_connection(path, limit=_MAX_REPLY)
            try:
                # A refusal may come in the middle of a long body: read it.
                with suppress(ConnectionError):
                    writer.write(to_json(request).encode() + b"\n")
                    for piece in body:
                        writer.write(piece)
                        await writer.drain()
                line = await reader.readline()
            finally:
                writer.close()
    except OSError as error:
        if isinstance(error, TimeoutError):
            raise HelperError(f"The helper did not answer in time: see journalctl -u '{name}@*'") from error
        remedy = f"is it switched off? sudo systemctl status {name}.socket"
        raise HelperError(f"The helper for changes to this Pi cannot be reached: {remedy}") from error
    except ValueError as error:
        raise HelperError("The helper's answer is too long.") from error
    return _read(line)


def _read(line: bytes) -> Json:
    try:
        reply: Json = json.loads(line)
        if "error" not in reply:
            return reply
    except (ValueError, TypeError) as error:
        raise HelperError("The helper ended without an answer: see journalctl -u 'naze-bridge-helper-*@*'") from error
    raise HelperError(str(reply["error"]))
