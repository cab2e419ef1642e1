# SPDX-License-Identifier: GPL-3.0-or-later
"""UDP links: replies to the sender, a network that is down."""

import socket

import pytest

from bridge.gcs.station import Peer
from tests.service.links.test_gcs_links import FRAME
from tests.support.links import Links, received
from tests.support.programs import free_port, until_async


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
async def test_udpin_answers_to_the_senders_address(links: Links, host: str) -> None:
    port = free_port(socket.SOCK_DGRAM, host)
    link = links.open(f"udpin:{f'[{host}]' if ':' in host else host}:{port}")
    clients = [links.udp(host) for _ in range(2)]
    for client in clients:
        client.sendto(FRAME, (host, port))
    await until_async(lambda: len(links.events.received) == 2, "both datagrams")
    for (peer, data), client in zip(links.events.received, clients, strict=True):
        assert data == FRAME
        link.send(peer, str(peer).encode())
        assert await received(client) == str(peer).encode()


async def test_a_network_that_is_down_loses_only_the_datagram(links: Links) -> None:
    link = links.open(f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}")
    client = links.udp()
    for unreachable in (("192.0.2.1", 14550), ("255.255.255.255", 14550), ("127.0.0.1", 0)):
        # From a socket bound to loopback: ENETUNREACH or EINVAL; EACCES; EINVAL.
        link.send(Peer(link.name, unreachable), FRAME)
    link.send(Peer(link.name, client.getsockname()), bytes(70000))
    link.send(Peer(link.name, client.getsockname()), FRAME)
    assert await received(client) == FRAME


async def test_datagrams_to_a_closed_port_block_nothing(links: Links) -> None:
    link = links.open(f"udpin:127.0.0.1:{free_port(socket.SOCK_DGRAM)}")
    deaf, client = links.udp(), links.udp()
    for _ in range(5000):
        link.send(Peer(link.name, deaf.getsockname()), bytes(280))
    link.send(Peer(link.name, client.getsockname()), FRAME)
    assert await received(client) == FRAME
