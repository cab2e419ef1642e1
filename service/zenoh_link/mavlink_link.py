# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink over zenoh: a link to ground stations like the others. Frames go out only while a subscriber reads them."""

import asyncio

import zenoh

from bridge.gcs.station import Peer
from service.links.gcs_events import GcsEvents
from service.zenoh_link.keys import MAVLINK_OUT
from service.zenoh_link.publisher import Publisher
from service.zenoh_link.threads import post

#: Whoever reads is one peer: zenoh does not tell them apart.
_READERS = Peer("zenoh", MAVLINK_OUT.suffix)
#: More than a datagram of any link holds; what is larger is no MAVLink.
_MAX_BYTES = 2048
#: What comes in faster than the event loop takes it is dropped beyond this.
_MAX_WAITING = 64


class MavlinkLink:
    """Implements GcsLink."""

    name = "zenoh"

    def __init__(self, publisher: Publisher, events: GcsEvents) -> None:
        self._publisher = publisher
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._waiting = 0

    def declare_input(self, session: zenoh.Session, name: str) -> None:
        """Take frames at the key `name`; called on the session's thread."""
        session.declare_subscriber(name, zenoh.handlers.Callback(self._arrived, indirect=False))

    def read(self, *, is_read: bool) -> None:
        """Somebody reads mavlink/out, or nobody does any more."""
        if is_read:
            self._events.add_default_peer(_READERS)
        else:
            self._events.remove_default_peer(_READERS)

    def send(self, peer: Peer, data: bytes) -> None:
        """Publish a datagram."""
        if self._publisher.has_readers(MAVLINK_OUT):
            self._publisher.put_raw(MAVLINK_OUT, data)

    def close(self) -> None:
        """The session closes what was declared."""

    def _arrived(self, sample: zenoh.Sample) -> None:
        if self._waiting < _MAX_WAITING and len(sample.payload) <= _MAX_BYTES:
            self._waiting += 1
            post(self._loop, self._take, sample.payload.to_bytes())

    def _take(self, data: bytes) -> None:
        self._waiting -= 1
        self._events.gcs_data(_READERS, data, datagram=True)
