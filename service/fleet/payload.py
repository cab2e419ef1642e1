# SPDX-License-Identifier: GPL-3.0-or-later
"""What comes over zenoh, as plain data that may be printed. Strangers publish, too: nothing here raises."""

from typing import Any

import cbor2
import zenoh

from service.mission_data import Json
from service.zenoh_link.payload import decoded


def decode(sample: zenoh.Sample | zenoh.ReplyError) -> Json | None:
    """Return the object in a payload, JSON or CBOR as its encoding says; None if there is none."""
    try:
        value = decoded(sample.payload.to_bytes(), str(sample.encoding))
    except (ValueError, RecursionError, cbor2.CBORError):
        return None
    return value if isinstance(value, dict) else None


def decode_reply(reply: zenoh.Reply) -> Json | None:
    """Return the object in a reply that is no error."""
    return decode(reply.ok) if reply.ok is not None else None


def part(data: Json, *path: str) -> Any:
    """Return data[path[0]][path[1]]...; None where that does not exist."""
    value: Any = data
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def text(data: Json, *path: str) -> str | None:
    """Return the text there, without what would move a terminal's cursor."""
    value = part(data, *path)
    return "".join(each if each.isprintable() else "?" for each in value) if isinstance(value, str) else None


def number(data: Json, *path: str) -> float | None:
    """Return the number there."""
    value = part(data, *path)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def whole(data: Json, *path: str) -> int | None:
    """Return the whole number there."""
    value = part(data, *path)
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def flag(data: Json, *path: str) -> bool | None:
    """Return true or false if one of them is there."""
    value = part(data, *path)
    return value if isinstance(value, bool) else None
