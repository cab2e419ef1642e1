# SPDX-License-Identifier: GPL-3.0-or-later
"""UDP links: replies to the sender, a socket for each connected station, a network that is down."""

import asyncio
import socket
from typing import Any

import pytest

from bridge.gcs.station import Peer
from service.links.gcs_links import GcsLink, LinkError
from tests.service.links.test_gcs_links import FRAME
from tests.support.links import Links
from tests.support.programs import TIMEOUT_S, free_port, until_async


async def reply_from(port: int, client: socket.socket) -> tuple[bytes, Any]:
    """The next datagram from this port. Another test's program may still send to the client's port."""
    async with asyncio.timeout(TIMEOUT_S):
        while True:
            data, sender = await asyncio.get_running_loop().sock_recvfrom(client, 4096)
            if sender[1] == port:
                return data, sender


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
        data, _ = await reply_from(port, client)
        assert data == str(peer).encode()


async def test_a_network_that_is_down_loses_only_the_datagram(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:127.0.0.1:{port}")
    client = links.udp()
    for unreachable in (("192.0.2.1", 14550), ("255.255.255.255", 14550), ("127.0.0.1", 0)):
        # From a socket bound to loopback: ENETUNREACH or EINVAL; EACCES; EINVAL.
        link.send(Peer(link.name, unreachable), FRAME)
    link.send(Peer(link.name, client.getsockname()), bytes(70000))
    link.send(Peer(link.name, client.getsockname()), FRAME)
    data, _ = await reply_from(port, client)
    assert data == FRAME


async def test_datagrams_to_a_closed_port_do_not_block(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:127.0.0.1:{port}")
    deaf, client = links.udp(), links.udp()
    for _ in range(5000):
        link.send(Peer(link.name, deaf.getsockname()), bytes(280))
    link.send(Peer(link.name, client.getsockname()), FRAME)
    data, _ = await reply_from(port, client)
    assert data == FRAME


async def connected(links: Links, link: GcsLink, client: socket.socket, address: tuple[str, int]) -> Peer:
    """A station that is connected, and has been heard since, so that it has a socket of its own."""
    peer = Peer(link.name, client.getsockname())
    links.events.connected.add(peer)
    client.sendto(FRAME, address)
    await until_async(lambda: peer in link._own, "the station's socket")  # type: ignore[attr-defined]
    links.events.received.clear()
    return peer


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
async def test_a_connected_station_is_heard_and_answered_over_its_own_socket(links: Links, host: str) -> None:
    port = free_port(socket.SOCK_DGRAM, host)
    link = links.open(f"udpin:{f'[{host}]' if ':' in host else host}:{port}")
    stations, stranger = [links.udp(host) for _ in range(3)], links.udp(host)
    peers = [await connected(links, link, each, (host, port)) for each in stations]
    for client in (*stations, stranger):
        client.sendto(str(client.getsockname()).encode(), (host, port))
    await until_async(lambda: len(links.events.received) == 4, "all datagrams")
    strange = Peer(link.name, stranger.getsockname())
    expected = {(peer, str(peer.key).encode()) for peer in (*peers, strange)}
    assert set(links.events.received) == expected
    for peer, client in zip((*peers, strange), (*stations, stranger), strict=True):
        link.send(peer, FRAME)
        assert await reply_from(port, client) == (FRAME, (*(host, port), *peer.key[2:]))  # type: ignore[index]


@pytest.mark.parametrize("any_host", ["0.0.0.0", "[::]"])  # noqa: S104 - the address under test
async def test_replies_leave_from_the_address_that_the_station_sends_to(links: Links, any_host: str) -> None:
    """A Pi may have several: of its hotspot, of a cable."""
    to, host = ("127.0.0.2", "127.0.0.1") if any_host == "0.0.0.0" else ("::1", "::1")  # noqa: S104
    port = free_port(socket.SOCK_DGRAM, host)
    link = links.open(f"udpin:{any_host}:{port}")
    client = links.udp(host)
    peer = await connected(links, link, client, (to, port))
    link.send(peer, FRAME)
    _, sender = await reply_from(port, client)
    assert sender[:2] == (to, port)


async def test_datagrams_of_others_that_arrive_before_a_socket_is_connected_are_theirs(
    links: Links, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:0.0.0.0:{port}")
    client, stranger = links.udp(), links.udp()

    class Late(socket.socket):
        """Others are faster."""

        def connect(self, address: Any) -> None:
            stranger.sendto(FRAME, ("127.0.0.1", port))
            super().connect(address)

    monkeypatch.setattr("service.links.udp_link.socket.socket", Late)
    peer = Peer(link.name, client.getsockname())
    links.events.connected.add(peer)
    client.sendto(FRAME, ("127.0.0.1", port))
    await until_async(lambda: len(links.events.received) == 2, "the other's datagram")
    assert links.events.received == [(peer, FRAME), (Peer(link.name, stranger.getsockname()), FRAME)]
    client.sendto(b"own", ("127.0.0.1", port))
    await until_async(lambda: len(links.events.received) == 3, "the station's datagram")
    assert links.events.received[2] == (peer, b"own")


async def test_a_station_whose_program_restarts_keeps_the_socket(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:127.0.0.1:{port}")
    client = links.udp()
    address = client.getsockname()
    peer = await connected(links, link, client, ("127.0.0.1", port))
    client.close()
    for _ in range(3):
        link.send(peer, FRAME)  # to a closed port: the next call fails
        await asyncio.sleep(0)
    again = links.udp()
    again.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.setblocking(False)
        again.bind(address)
        again.sendto(b"again", ("127.0.0.1", port))
        await until_async(lambda: links.events.received, "its datagram")
        link.send(peer, FRAME)
        data, _ = await reply_from(port, again)
        assert data == FRAME


async def test_the_socket_of_a_station_that_has_left_is_closed_when_another_connects(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:127.0.0.1:{port}")
    first, second = links.udp(), links.udp()
    left = await connected(links, link, first, ("127.0.0.1", port))
    links.events.connected.remove(left)
    peer = await connected(links, link, second, ("127.0.0.1", port))
    assert [*link._own] == [peer]  # type: ignore[attr-defined]
    first.sendto(b"back again", ("127.0.0.1", port))
    await until_async(lambda: (left, b"back again") in links.events.received, "its datagram")


async def test_a_second_daemon_cannot_share_the_port(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    link = links.open(f"udpin:127.0.0.1:{port}")
    await connected(links, link, links.udp(), ("127.0.0.1", port))
    for host in ("127.0.0.1", "0.0.0.0"):  # noqa: S104 - the address under test
        with pytest.raises(LinkError, match="stop the program that uses it"):
            links.open(f"udpin:{host}:{port}")
