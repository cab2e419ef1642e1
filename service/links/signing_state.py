# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys of a daemon's links, and their signing timestamps, which survive a restart.

A Pi lacks a battery-backed clock: after a reboot its time may be a day behind. New signatures would then reuse old
timestamps, and recorded signatures would be accepted. So the last timestamp is kept in a file. To spare the SD card, it
runs 10 s ahead. A clean stop writes the true value. After a power cut the timestamps heard since the last write are
unknown, but all are below the file's: nothing up to that time is accepted any more, also after another restart.
"""

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bridge.gcs.rights import LinkAccess
from protocols.mavlink.signing import TICKS_PER_S, TOLERANCE, Signing, Timestamps
from service.machine.state_file import StateFile
from service.settings.addresses import GcsAddress
from service.settings.write_access import WriteAccess

FILE_NAME = "signing.json"
#: The timestamp in the file, the streams' by link, the timestamp up to which frames are refused, the newest of a peer.
_Kept = tuple[int, Mapping[str, list[list[int]]], int, int | None]
#: The file's lead, and so how long signatures are refused after a power cut.
_AHEAD = 10 * TICKS_PER_S
_LOOK_S = 1.0


class SigningState:
    """Makes the `links` that a bridge guards. Without a `state_dir` or any key they are not kept."""

    def __init__(
        self,
        state_dir: Path | None,
        gcs: Sequence[GcsAddress],
        access_by_link: Mapping[str, WriteAccess],
        clock: Callable[[], float] = time.time,
        is_clock_set: Callable[[], bool] = lambda: True,
    ) -> None:
        keys = {name: access.key for name, access in access_by_link.items() if access.key is not None}
        self._file: StateFile | None = None
        kept: _Kept | None = None
        if keys and state_dir is not None:
            self._file = StateFile(state_dir, FILE_NAME, "timestamps restart from the clock")
            kept = self._file.load(_read)
        self._stored, streams, self._refused_until, newest = kept or (0, {}, -1, 0)
        self._stored_newest = newest or 0
        self._timestamps = Timestamps(clock, self._stored, newest, is_clock_set)
        by_key = {key: Signing(key, self._timestamps, self._refused_until) for key in keys.values()}
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
            for number, address in enumerate(gcs)
            if (access := access_by_link.get(str(address))) is not None
        }
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Keep the file ahead of the signed timestamps. Must be called on a running event loop."""
        if self._file is not None:
            self._look(asyncio.get_running_loop(), self._file)

    def reset(self) -> None:
        """Forget the timestamps of all ground stations. The next station with the key is believed."""
        self._timestamps.forget()
        for signing in self._signings.values():
            signing.forget()
        self._stored = self._stored_newest = 0
        self._refused_until = -1
        if self._file is not None:
            self._file.save(self._state(self._timestamps.now(), self._refused_until))

    def close(self) -> None:
        """Write the true timestamp."""
        if self._file is None:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._file.save(self._state(self._timestamps.now(), self._refused_until))
        self._file.close()

    def _look(self, loop: asyncio.AbstractEventLoop, file: StateFile) -> None:
        """Write once the stored time is reached, by our clock or by a peer's that is ahead."""
        newest = self._timestamps.newest or 0
        if self._timestamps.last >= self._stored or newest > self._stored_newest:
            self._stored, self._stored_newest = self._timestamps.now() + _AHEAD, newest + _AHEAD
            lead = _AHEAD + int(_LOOK_S * TICKS_PER_S)
            file.save(self._state(self._stored, self._stored + lead - _AHEAD, lead))
        self._timer = loop.call_later(_LOOK_S, self._look, loop, file)

    def _state(self, timestamp: int, refused_until: int, lead: int = 0) -> dict[str, object]:
        """The contents for the next run. Streams that it would reject as too old anyway are left out.

        `lead`: the file runs ahead of the streams of clocks that are ahead of ours, like the timestamp.
        """
        late = timestamp - TOLERANCE
        streams = {
            name: [
                [*stream, last if last <= refused_until else last + lead]
                for stream, last in signing.streams.items()
                if last >= late
            ]
            for name, signing in self._signings.items()
        }
        newest = self._timestamps.newest
        return {"timestamp": timestamp, "refused_until": refused_until, "streams": streams, "newest": newest}


def _read(state: Any) -> _Kept:
    streams = {
        str(name): [[int(number) for number in (sysid, compid, link_id, last)] for sysid, compid, link_id, last in all_]
        for name, all_ in state["streams"].items()
    }
    newest = state["newest"]
    return int(state["timestamp"]), streams, int(state["refused_until"]), None if newest is None else int(newest)
