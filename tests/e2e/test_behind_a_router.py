# SPDX-License-Identifier: GPL-3.0-or-later
"""A real client behind a router: it answers the question that only its address gets.

Loopback is an own network of every machine, so the bridge is told otherwise here, and needs no flight controller.
"""

import asyncio
import socket

from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk

from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.gcs.station import Datagrams, Peer
from tests.support.programs import TIMEOUT_S


async def serve(link: socket.socket) -> Bridge:
    """Run a bridge until a ground station is connected."""
    loop = asyncio.get_running_loop()
    bridge = Bridge(BridgeConfig((None,), is_near=lambda _address: False), loop.time())
    while not bridge.report(loop.time()).link.ground_stations:
        try:
            async with asyncio.timeout(max(bridge.due - loop.time(), 0.01)):
                data, sender = await loop.sock_recvfrom(link, 2048)
            bridge.gcs_received(Peer("udp", sender), data, loop.time(), datagram=True)
        except TimeoutError:
            bridge.tick(loop.time())
        for effect in bridge.take():
            for peer, datagram in effect if isinstance(effect, Datagrams) else ():
                link.sendto(datagram, peer.key)  # type: ignore[call-overload]
    return bridge


async def test_mavsdk_proves_the_address_by_itself() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.setblocking(False)
        async with (
            asyncio.timeout(TIMEOUT_S),
            Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk,
        ):
            await mavsdk.add_any_connection(f"udpout://127.0.0.1:{link.getsockname()[1]}")
            bridge = await serve(link)
    assert not bridge.counters().refused
