# SPDX-License-Identifier: GPL-3.0-or-later
"""TCP clients that stop reading affect no others, and get important frames when they resume."""

import asyncio
import socket

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.station import Peer
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from service.links.tcp_link import TcpLink
from service.settings.addresses import GcsAddress
from tests.support.packing import pack
from tests.support.programs import TIMEOUT_S, free_port


class Listener:
    """Records the link's events."""

    def __init__(self) -> None:
        self.peers: list[Peer] = []
        self.came = asyncio.Event()

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        raise AssertionError("no data expected")

    def is_connected(self, _peer: Peer) -> bool:
        raise AssertionError("asked for UDP only")

    def gcs_gone(self, peer: Peer) -> None:
        """The connection is closed."""

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        self.peers.append(peer)
        self.came.set()

    def remove_default_peer(self, peer: Peer) -> None:
        self.peers.remove(peer)


async def connected(listener: Listener, link: TcpLink, port: int) -> tuple[socket.socket, Peer]:
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.setblocking(False)
    listener.came.clear()
    await asyncio.get_running_loop().sock_connect(client, ("127.0.0.1", port))
    await listener.came.wait()
    return client, listener.peers[-1]


def number_of(frame: MavlinkFrame) -> int | None:
    is_attitude = frame.msgid == m.MAVLINK_MSG_ID_ATTITUDE
    return int.from_bytes(frame.payload[:4], "little") if is_attitude else None


async def read_to(client: socket.socket, last: int) -> list[MavlinkFrame]:
    """Read up to the attitude with that number; only whole frames may be received."""
    loop, splitter, data = asyncio.get_running_loop(), MavlinkSplitter(), b""
    frames: list[MavlinkFrame] = []
    async with asyncio.timeout(TIMEOUT_S):
        while not frames or number_of(frames[-1]) != last:
            piece = await loop.sock_recv(client, 65536)
            assert piece
            data += piece
            frames += splitter.feed(piece)
    assert b"".join(frame.raw for frame in frames) == data
    return frames


async def test_a_stalled_client_loses_only_telemetry() -> None:
    listener, port = Listener(), free_port(socket.SOCK_STREAM)
    link = TcpLink(GcsAddress("tcpin", "127.0.0.1", port), listener)
    stalled, stalled_peer = await connected(listener, link, port)
    reading, reading_peer = await connected(listener, link, port)
    writer = FrameWriter(1, 1)
    received: list[MavlinkFrame] = []
    count = 20000
    for number in range(count):
        frame = writer.frame(pack(m.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2)
        for peer in (stalled_peer, reading_peer):
            link.send(peer, frame)
        if number % 500 == 0:
            ack = writer.frame(pack(m.MAVLink_mission_request_message(255, 190, number // 500, 0)), 2)
            link.send(stalled_peer, ack)
            received += await read_to(reading, number)
    received += await read_to(reading, count - 1)
    assert len(received) == count
    late = asyncio.get_running_loop().create_task(read_to(stalled, count))
    while not late.done():
        link.send(stalled_peer, writer.frame(pack(m.MAVLink_attitude_message(count, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2))
        await asyncio.sleep(0)
    frames = late.result()
    asked = [frame.payload[0] for frame in frames if frame.msgid == m.MAVLINK_MSG_ID_MISSION_REQUEST]
    assert asked == list(range(count // 500))
    attitudes = [shown for frame in frames if (shown := number_of(frame)) is not None]
    assert attitudes == sorted(attitudes)
    assert len(attitudes) < count / 2
    link.close()
    stalled.close()
    reading.close()
