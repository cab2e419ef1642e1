# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink over zenoh: a link to ground stations like the others. Frames go out only while a subscriber reads them."""

import asyncio
from collections.abc import Set

import zenoh

from bridge.gcs.station import Peer
from payloads.keys import MAVLINK_OUT, MAX_MAVLINK_BYTES
from service.daemon.daemon import GcsConnections
from service.machine.threads import post
from service.zenoh_link.publisher import Publisher

#: All subscribers are one peer: zenoh does not tell them apart.
_READERS = Peer("zenoh", MAVLINK_OUT.suffix)
#: Samples beyond this are dropped when they arrive faster than the event loop takes them.
_MAX_WAITING = 64


class MavlinkLink:
    """Implements GcsLink. `others`: bridges with the same name. They also get all frames, so none is accepted."""

    name = "zenoh"

    def __init__(self, publisher: Publisher, events: GcsConnections, others: Set[str]) -> None:
        self._publisher = publisher
        self._events = events
        self._others = others
        self._loop = asyncio.get_running_loop()
        self._waiting = 0

    def declare_input(self, session: zenoh.Session, name: str) -> None:
        """Take frames at the key `name`. Called on the session's thread."""
        session.declare_subscriber(name, zenoh.handlers.Callback(self._arrived, indirect=False))

    def read(self, *, is_read: bool) -> None:
        """mavlink/out got the first subscriber, or lost the last."""
        if is_read:
            self._events.add_default_peer(_READERS)
        else:
            self._events.remove_default_peer(_READERS)

    def send(self, peer: Peer, data: bytes) -> None:
        if self._publisher.has_readers(MAVLINK_OUT):
            self._publisher.put_raw(MAVLINK_OUT, data)

    def close(self) -> None:
        """The session undeclares everything."""

    def _arrived(self, sample: zenoh.Sample) -> None:
        if self._waiting < _MAX_WAITING and len(sample.payload) <= MAX_MAVLINK_BYTES:
            self._waiting += 1
            post(self._loop, self._take, sample.payload.to_bytes())

    def _take(self, data: bytes) -> None:
        self._waiting -= 1
        if not self._others:
            self._events.gcs_data(_READERS, data, datagram=True)
