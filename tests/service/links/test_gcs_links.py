# SPDX-License-Identifier: GPL-3.0-or-later
"""UDP and TCP links without a daemon, on real sockets."""

import asyncio
import socket
import threading

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.station import Peer
from protocols.mavlink.codec import FrameWriter
from service.links import tcp_link, udp_link
from service.links.fc_device import device_opener
from service.links.gcs_links import LinkError, open_link
from service.settings.addresses import TcpFc, parse_fc, parse_gcs
from tests.support.links import Links, RecordedEvents, received
from tests.support.packing import pack
from tests.support.programs import TIMEOUT_S, free_port, until_async

FRAME = bytes.fromhex("fe09000101000000000002030000030346f1")


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
async def test_tcpin_serves_each_client(links: Links, host: str) -> None:
    port = free_port(socket.SOCK_STREAM, host)
    link = links.open(f"tcpin:{f'[{host}]' if ':' in host else host}:{port}")
    client = links.tcp(port, host)
    await until_async(lambda: links.events.default_peers, "the client")
    (peer,) = links.events.default_peers
    link.send(peer, FRAME)
    assert await received(client) == FRAME
    client.close()
    await until_async(lambda: links.events.gone == [peer], "its end")
    assert links.events.default_peers == {}


async def test_ipv4_and_ipv6_have_a_port_each(links: Links) -> None:
    port = free_port(socket.SOCK_DGRAM)
    links.open(f"udpin:0.0.0.0:{port}")
    links.open(f"udpin:[::]:{port}")


async def test_a_host_name_is_used_once_it_resolves(links: Links, monkeypatch: pytest.MonkeyPatch) -> None:
    """The network comes up after the daemon, and the name's address changes."""
    first, second = links.udp(), links.udp()
    answers: list[list[tuple[str, int]]] = [[], [], [first.getsockname()], [first.getsockname(), ("127.0.0.9", 9)]]
    answers += [[], [("127.0.0.9", 9), first.getsockname()], [second.getsockname()]]
    asked = 0
    monkeypatch.setattr(udp_link, "_LOOK_UP_S", 0.01)

    def look_up(host: str, port: int, *_: object, flags: int = 0) -> list[tuple[object, ...]]:
        nonlocal asked
        if flags & socket.AI_NUMERICHOST:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        assert (host, port) == ("laptop.local", 14550)
        found = answers[min(asked, len(answers) - 1)]
        asked += 1
        if not found:
            raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")
        return [(socket.AF_INET, socket.SOCK_DGRAM, 17, "", address) for address in found]

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    link = links.open("udpout:laptop.local:14550")
    seen: list[list[Peer]] = []
    while not seen or asked <= len(answers):
        if not seen or seen[-1] != list(links.events.default_peers):
            seen.append(list(links.events.default_peers))
        await asyncio.sleep(0)
    assert [[peer.key for peer in peers] for peers in seen] == [[], [first.getsockname()], [second.getsockname()]]
    link.send(seen[-1][0], FRAME)
    assert await received(second) == FRAME


@pytest.mark.parametrize("kind", ["gcs", "fc"])
def test_a_name_server_that_is_silent_does_not_delay_the_end(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the field there is often no network behind the Pi's."""
    asked, answers = threading.Event(), threading.Event()

    def look_up(*_: object, flags: int = 0) -> list[object]:
        if not flags & socket.AI_NUMERICHOST:
            asked.set()
            answers.wait()
        raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")

    async def main() -> None:
        if kind == "gcs":
            link = open_link(parse_gcs("udpout:laptop.local:14550"), RecordedEvents())
            await until_async(asked.is_set, "the lookup")
            link.close()
        else:
            opening = asyncio.ensure_future(device_opener(TcpFc("naze.local", 5760))())
            await until_async(asked.is_set, "the lookup")
            opening.cancel()

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    daemon = threading.Thread(target=asyncio.run, args=(main(),), daemon=True)
    daemon.start()
    daemon.join(TIMEOUT_S)
    has_ended = not daemon.is_alive()
    answers.set()
    assert has_ended


async def test_localhost_is_resolved(links: Links) -> None:
    client = links.udp()
    port = client.getsockname()[1]
    link = links.open(f"udpout:localhost:{port}")
    await until_async(lambda: links.events.default_peers, "the address")
    (peer,) = links.events.default_peers
    assert peer.key == ("127.0.0.1", port)
    link.send(peer, FRAME)
    assert await received(client) == FRAME


async def test_a_client_above_the_limit_displaces_another(links: Links) -> None:
    port = free_port(socket.SOCK_STREAM)
    links.open(f"tcpin:127.0.0.1:{port}")
    clients = [links.tcp(port) for _ in range(tcp_link._MAX_CLIENTS)]
    await until_async(lambda: len(links.events.default_peers) == len(clients), "all clients")
    links.tcp(port)
    await until_async(lambda: links.events.gone, "the end of another")
    assert len(links.events.default_peers) == len(clients)
    # The longest-silent one is displaced; none has sent anything.
    assert await received(clients[0]) == b""


async def test_a_client_that_does_not_read_is_disconnected(links: Links, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tcp_link, "_STALL_MS", 500)
    port = free_port(socket.SOCK_STREAM)
    link = links.open(f"tcpin:127.0.0.1:{port}")
    links.tcp(port)
    await until_async(lambda: links.events.default_peers, "the client")
    (peer,) = links.events.default_peers

    def sends_on() -> bool:
        for _ in range(100):
            link.send(peer, FRAME * 10)
        return bool(links.events.gone)

    await until_async(sends_on, "the end")
    assert links.events.default_peers == {}


async def test_clients_that_do_not_read_are_disconnected_after_a_round(links: Links) -> None:
    """Not during the round, which would reorder frames for other clients."""
    port = free_port(socket.SOCK_STREAM)
    link = links.open(f"tcpin:127.0.0.1:{port}")
    links.tcp(port)
    await until_async(lambda: links.events.default_peers, "the client")
    (peer,) = links.events.default_peers
    ack = FrameWriter(1, 1).frame(pack(m.MAVLink_mission_ack_message(255, 190, 1, 0)), 2)
    for _ in range(200000):
        link.send(peer, ack)
        assert not links.events.gone
    await until_async(lambda: links.events.gone == [peer], "the end")


@pytest.mark.parametrize("host", ["127.0.0.1", "::1", "localhost"])
async def test_a_flight_controller_may_be_behind_tcp(host: str) -> None:
    with socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET) as server:
        address = parse_fc(f"tcp:{f'[{host}]' if ':' in host else host}:{server.getsockname()[1]}")
        assert isinstance(address, TcpFc)
        device = await device_opener(address)()
        server.accept()[0].close()
        device.close()


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
async def test_a_link_local_address_keeps_the_interface(links: Links, kind: str) -> None:
    """The loopback has no such address. Without the interface the kernel would call it an invalid argument."""
    with pytest.raises(LinkError, match="this machine does not have that address"):
        links.open(f"{kind}:[fe80::1%lo]:{free_port()}")


@pytest.mark.parametrize(("host", "shown"), [("127.0.0.1", "127.0.0.1:{}"), ("::1", "[::1]:{}")])
async def test_a_station_is_named_by_the_address(links: Links, host: str, shown: str) -> None:
    port = free_port()
    link = links.open(f"udpin:[{host}]:{port}")
    client = links.udp(host)
    client.sendto(FRAME, (host, port))
    await until_async(lambda: links.events.received, "the frame")
    ((peer, _),) = links.events.received
    assert str(peer) == f"{link.name} {shown.format(client.getsockname()[1])}"
