# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads: plain data in JSON, or compact CBOR for the overview, with a version, a sequence number and a time."""

import json
from collections.abc import Callable
from typing import Any

import zenoh

from payloads.keys import COMMAND_KEYS, OVERVIEW, VERSION, ZenohKey
from payloads.mission_data import Json, to_json
from payloads.overview import packed, unpacked

_write_json = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode
_SCHEMA = f"naze-bridge/v{VERSION}/"


def encoding_of(key: ZenohKey) -> zenoh.Encoding:
    """The encoding of a sample: JSON, and CBOR for the overview, with its schema's name.

    With JSON the attachment names the schema: zenohd's REST plugin shows it as such only without a suffix.
    """
    if key.schema is None:
        return zenoh.Encoding.APPLICATION_OCTET_STREAM
    if key is OVERVIEW:
        return zenoh.Encoding.APPLICATION_CBOR.with_schema(_SCHEMA + key.schema)
    return zenoh.Encoding.APPLICATION_JSON


def attachment_of(key: ZenohKey) -> str | None:
    """The attachment of a sample, as in "naze-bridge/v1/state", or None if it has none."""
    return None if key.schema is None or key is OVERVIEW else _SCHEMA + key.schema


def decoded(data: bytes, encoding: str) -> Any:
    """The contents of `data`, by the encoding of its sample. ValueError or cbor2.CBORError if it cannot be read."""
    if encoding.startswith(str(zenoh.Encoding.APPLICATION_CBOR)):
        return unpacked(data)
    return json.loads(data)


def encode(key: ZenohKey, body: Json) -> bytes:
    """Encode a payload. May be called on any thread."""
    return packed(body) if key is OVERVIEW else _write_json(body).encode()


class Payloads:
    """Makes the payloads of one vehicle. Each key has its own sequence. `clock`: seconds since 1970 (UTC)."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._next: dict[str, int] = {}

    def _envelope(self, key: ZenohKey, seq: int) -> Json:
        time_s = self._clock()
        return {"v": VERSION, "seq": seq, "time_s": round(time_s) if key is OVERVIEW else time_s}

    def head(self, key: ZenohKey) -> Json:
        """Begin the next payload of a key."""
        seq = self._next.get(key.suffix, 0)
        self._next[key.suffix] = seq + 1
        return self._envelope(key, seq)

    def reply(self, key: ZenohKey, body: Json) -> bytes:
        """Make the reply to a query: it has the number of the last sample. A command's reply lacks the head."""
        if key in COMMAND_KEYS:
            return to_json(body).encode()
        seq = max(self._next.get(key.suffix, 0) - 1, 0)
        return encode(key, self._envelope(key, seq) | body)
