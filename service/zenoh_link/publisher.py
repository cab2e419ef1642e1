# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples that are sent at once or dropped: telemetry, the state and MAVLink frames. Runs on the event loop.

zenoh's put() with DROP and a `wait_before_drop` of 0 never waits for a receiver: docs/zenoh.md, "Limits".
"""

import asyncio
from collections.abc import Callable

import zenoh
from zenoh import ext

from payloads.keys import STATE, SampleDelivery, ZenohKey
from payloads.mission_data import Json
from payloads.payload import Payloads, attachment_of, encode, encoding_of
from service.machine.threads import post

#: How soon after a sample its number is published, so that a subscriber notices if the last was lost.
_LAST_NUMBER_S = 1.0


class Publisher:
    """Publishes a vehicle's samples, and knows which keys have subscribers: telemetry without one is not even encoded.

    Samples of kept keys are put in any case. A subscriber that was away, or joins late, asks the publisher for them.
    zenoh's AdvancedSubscriber does so by itself.
    """

    def __init__(self, payloads: Payloads, on_readers: Callable[[ZenohKey, bool], None]) -> None:
        self._payloads = payloads
        self._on_readers = on_readers
        self._loop = asyncio.get_running_loop()
        self._publishers: dict[str, zenoh.Publisher | ext.AdvancedPublisher] = {}
        self._read: set[str] = set()
        self._listeners: list[zenoh.MatchingListener[None]] = []
        #: Samples that zenoh rejected.
        self.failed = 0

    def declare(self, session: zenoh.Session, key: ZenohKey, name: str) -> None:
        """Declare a key's publisher. `name`: the full key. Called on the session's thread."""
        if key.kept:
            self._publishers[key.suffix] = self._declare_kept(session, key, name)
            return
        publisher = session.declare_publisher(
            name,
            encoding=encoding_of(key),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA,
            # Lets a datagram link send it unreliably; TCP ignores it.
            reliability=zenoh.Reliability.BEST_EFFORT,
        )
        self._publishers[key.suffix] = publisher

        def changed(status: zenoh.MatchingStatus) -> None:
            post(self._loop, self._changed, key, status.matching)

        # Called at once if there is a subscriber already.
        self._listeners.append(publisher.declare_matching_listener(zenoh.handlers.Callback(changed, indirect=False)))

    def _declare_kept(self, session: zenoh.Session, key: ZenohKey, name: str) -> ext.AdvancedPublisher:
        reliable = key.delivery is SampleDelivery.RELIABLE
        return ext.declare_advanced_publisher(
            session,
            name,
            encoding=encoding_of(key),
            congestion_control=zenoh.CongestionControl.BLOCK if reliable else zenoh.CongestionControl.DROP,
            # Each priority has its own queue: waiting samples do not delay telemetry.
            priority=zenoh.Priority.DATA_LOW if reliable else zenoh.Priority.DATA,
            cache=ext.CacheConfig(max_samples=key.kept),
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_LAST_NUMBER_S),
            publisher_detection=True,
        )

    @property
    def is_declared(self) -> bool:
        """True if the session is open and the vehicle's state can be put."""
        return STATE.suffix in self._publishers

    def has_readers(self, key: ZenohKey) -> bool:
        return key.suffix in self._read

    def put(self, key: ZenohKey, body: Json) -> None:
        self.put_raw(key, encode(key, self._payloads.head(key) | body))

    def put_raw(self, key: ZenohKey, data: bytes) -> None:
        try:
            self._publishers[key.suffix].put(data, attachment=attachment_of(key))
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
