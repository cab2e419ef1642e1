# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys of a daemon's links, and their timestamps, which outlive it.

A Pi has no clock that runs without power: after a reboot it may believe that it is yesterday. Signatures would begin
anew with timestamps that were used before, and recorded ones would be taken for new. So the last timestamp is kept in
a file, 10 s ahead of the truth, so that it is seldom written; at the end it is written as it is. After a power cut what
was heard since the last write is unknown, but it was signed before the file's time: until then nothing is taken.
"""

import asyncio
import json
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import structlog

from bridge.gcs.guard import LinkAccess
from protocols.mavlink.signing import TICKS_PER_S, TOLERANCE, Signing, Timestamps
from service.disk_thread import DiskThread
from service.settings import Settings
from storage.atomic_file import replace_file

FILE_NAME = "signing.json"
#: The file's lead over the truth, and so how long after a power cut signatures are refused. Shorter costs SD card life.
_AHEAD = 10 * TICKS_PER_S
_LOOK_S = 1.0
_CLOSE_TIMEOUT_S = 1.0

_log = structlog.get_logger()


class SigningState:
    """Makes the `links` that a bridge is to guard. Nothing is kept without a `state_dir`, or without any key."""

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.time) -> None:
        self._path = None if settings.state_dir is None else settings.state_dir / FILE_NAME
        keys = {name: access.key for name, access in settings.access.items() if access.key is not None}
        self._stored = 0
        streams: Mapping[str, list[list[int]]] = {}
        was_ended = True
        if keys and self._path is not None:
            self._stored, streams, was_ended = _load(self._path)
        self._timestamps = Timestamps(clock, self._stored)
        refused_until = -1 if was_ended else self._stored + int(_LOOK_S * TICKS_PER_S)
        by_key = {key: Signing(key, self._timestamps, refused_until) for key in keys.values()}
        self._signings = {name: by_key[key] for name, key in keys.items()}
        for name, signing in self._signings.items():
            for sysid, compid, link_id, timestamp in streams.get(name, ()):
                stream = sysid, compid, link_id
                signing.streams[stream] = max(timestamp, signing.streams.get(stream, 0))
        self.links = {
            str(address): LinkAccess(
                self._signings.get(str(address)),
                number & 0xFF,
                None if access.writers is None else access.has_address,
            )
            for number, address in enumerate(settings.gcs)
            if (access := settings.access.get(str(address))) is not None
        }
        self._thread = DiskThread("signing")
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Keep the file ahead of what was signed. Must be called on a running event loop."""
        if self._signings and self._path is not None:
            self._look(asyncio.get_running_loop(), self._path)

    def close(self) -> None:
        """Write the timestamp as it is."""
        if self._timer is not None and self._path is not None:
            self._timer.cancel()
            self._thread.submit(partial(_save, self._path, self._state(self._timestamps.now(), is_end=True)))
        self._thread.close(_CLOSE_TIMEOUT_S)

    def _look(self, loop: asyncio.AbstractEventLoop, path: Path) -> None:
        """Write when what is stored was reached: by time, or because somebody's clock is far ahead of ours."""
        if self._timestamps.last >= self._stored:
            self._stored = self._timestamps.now() + _AHEAD
            self._thread.submit(partial(_save, path, self._state(self._stored, is_end=False)))
        self._timer = loop.call_later(_LOOK_S, self._look, loop, path)

    def _state(self, timestamp: int, *, is_end: bool) -> bytes:
        """Put down what the next run must know. Streams that it would find too late anyway are left out."""
        late = timestamp - TOLERANCE
        streams = {
            name: [[*stream, last] for stream, last in signing.streams.items() if last >= late]
            for name, signing in self._signings.items()
        }
        return json.dumps({"timestamp": timestamp, "is_end": is_end, "streams": streams}).encode()


def _load(path: Path) -> tuple[int, Mapping[str, list[list[int]]], bool]:
    try:
        state = json.loads(path.read_bytes())
        timestamp = int(state["timestamp"])
        was_ended = bool(state.get("is_end", True))
        streams = {
            str(name): [
                [int(number) for number in (sysid, compid, link_id, last)] for sysid, compid, link_id, last in all_
            ]
            for name, all_ in state["streams"].items()
        }
    except FileNotFoundError:
        return 0, {}, True
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        _log.warning("signing.state_lost", file=str(path), why=str(error), what="timestamps begin with the clock")
        return 0, {}, True
    return timestamp, streams, was_ended


def _save(path: Path, state: bytes) -> None:
    try:
        replace_file(path, state)
    except OSError as error:
        _log.warning("signing.state_not_stored", file=str(path), why=error.strerror)
