# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads received over zenoh, as plain data that is safe to print.

They may come from any program, so these functions do not raise: a value that is missing or of another type is None.
"""

from typing import Any

import cbor2
import zenoh

from payloads.mission_data import Json, printable
from payloads.payload import decoded

_SHOWN = 500


def decode(sample: zenoh.Sample | zenoh.ReplyError) -> Json | None:
    """The object in a payload, JSON or CBOR by the encoding."""
    try:
        value = printable(decoded(sample.payload.to_bytes(), str(sample.encoding)))
    except (ValueError, RecursionError, cbor2.CBORError):
        return None
    return value if isinstance(value, dict) else None


def part(data: Json, *path: str) -> Any:
    """data[path[0]][path[1]]..."""
    value: Any = data
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def objects(data: Json, *path: str) -> list[Json]:
    """The objects in a list; anything else is left out."""
    value = part(data, *path)
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []


def text(data: Json, *path: str) -> str | None:
    """A text to be shown, so at most 500 characters of it."""
    value = part(data, *path)
    return value[:_SHOWN] if isinstance(value, str) else None


def number(data: Json, *path: str) -> float | None:
    value = part(data, *path)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def whole(data: Json, *path: str) -> int | None:
    value = part(data, *path)
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def flag(data: Json, *path: str) -> bool | None:
    value = part(data, *path)
    return value if isinstance(value, bool) else None
