# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink that arrives over zenoh."""

import asyncio
from typing import Any, cast

import zenoh

from service.daemon.gcs_connections import GcsConnections
from service.zenoh_link.mavlink_link import MavlinkLink
from service.zenoh_link.publisher import Publisher

HEARTBEAT = bytes.fromhex("fe09000101000000000002030000030346f1")


class Events:
    def __init__(self) -> None:
        self.received: list[bytes] = []

    def gcs_data(self, _peer: Any, data: bytes, *, datagram: bool) -> None:
        self.received.append(data)


class Sample:
    payload = zenoh.ZBytes(HEARTBEAT)


async def test_frames_are_dropped_while_another_bridge_has_the_same_name() -> None:
    """It gets them, too: a mission would be written to both aircraft."""
    events, others = Events(), {"0123"}
    link = MavlinkLink(cast("Publisher", None), cast("GcsConnections", events), others)
    link._arrived(cast("zenoh.Sample", Sample()))
    await asyncio.sleep(0)
    assert events.received == []
    others.clear()
    link._arrived(cast("zenoh.Sample", Sample()))
    await asyncio.sleep(0)
    assert events.received == [HEARTBEAT]
