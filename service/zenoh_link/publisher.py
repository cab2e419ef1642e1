# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples that are sent at once, or not at all: telemetry, the state and MAVLink frames. Runs on the event loop.

zenoh's put() with DROP and a `wait_before_drop` of 0 does not wait, whatever a receiver does: docs/zenoh.md, "Limits".
"""

import asyncio
from collections.abc import Callable

import zenoh

from service.mission_data import Json
from service.zenoh_link.keys import SampleDelivery, ZenohKey
from service.zenoh_link.payload import Payloads
from service.zenoh_link.threads import post


class Publisher:
    """Knows which keys somebody reads; what nobody reads is not even made."""

    def __init__(self, payloads: Payloads, on_readers: Callable[[ZenohKey, bool], None]) -> None:
        self._payloads = payloads
        self._on_readers = on_readers
        self._loop = asyncio.get_running_loop()
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._read: set[str] = set()
        self._listeners: list[zenoh.MatchingListener[None]] = []
        #: How many samples zenoh refused.
        self.failed = 0

    def declare(self, session: zenoh.Session, key: ZenohKey, name: str) -> None:
        """Declare a key's publisher; `name`: the key in full. Called on the session's thread."""
        reliable = key.delivery is SampleDelivery.RELIABLE
        publisher = session.declare_publisher(
            name,
            encoding=zenoh.Encoding.APPLICATION_OCTET_STREAM if key.schema is None else self._payloads.encoding,
            congestion_control=zenoh.CongestionControl.BLOCK if reliable else zenoh.CongestionControl.DROP,
            # Each priority has a queue of its own: what is waited for does not hold up what is not.
            priority=zenoh.Priority.DATA_LOW if reliable else zenoh.Priority.DATA,
        )
        self._publishers[key.suffix] = publisher

        def changed(status: zenoh.MatchingStatus) -> None:
            post(self._loop, self._changed, key, status.matching)

        # It is called at once if somebody reads already.
        self._listeners.append(publisher.declare_matching_listener(zenoh.handlers.Callback(changed, indirect=False)))

    def has_readers(self, key: ZenohKey) -> bool:
        """Tell whether anybody reads a key."""
        return key.suffix in self._read

    def put(self, key: ZenohKey, body: Json) -> None:
        """Publish plain data."""
        self.put_raw(key, self._payloads.encode(self._payloads.head(key) | body))

    def put_raw(self, key: ZenohKey, data: bytes) -> None:
        """Publish bytes."""
        try:
            self._publishers[key.suffix].put(data)
        except zenoh.ZError:
            self.failed += 1

    def _changed(self, key: ZenohKey, is_read: bool) -> None:
        if is_read == (key.suffix in self._read):
            return
        if is_read:
            self._read.add(key.suffix)
        else:
            self._read.discard(key.suffix)
        self._on_readers(key, is_read)
