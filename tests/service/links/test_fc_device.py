# SPDX-License-Identifier: GPL-3.0-or-later
"""A flight controller on TCP whose replies arrive byte by byte, each after the previous one's acknowledgement."""

import asyncio
import fcntl
import socket
import struct
import termios

import pytest

from service.links.fc_device import device_opener
from service.links.fc_port import FcPort
from service.links.traffic import Traffic
from service.settings.addresses import TcpFc
from tests.support.programs import TIMEOUT_S


def unacknowledged(connection: socket.socket) -> int:
    """The number of bytes not yet acknowledged by the other end's kernel."""
    (count,) = struct.unpack("i", fcntl.ioctl(connection, termios.TIOCOUTQ, bytes(4)))
    return int(count)


async def test_received_bytes_are_acknowledged_at_once() -> None:
    loop = asyncio.get_running_loop()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.setblocking(False)
        received: asyncio.Queue[int] = asyncio.Queue()
        port = FcPort(
            device_opener(TcpFc("127.0.0.1", listener.getsockname()[1])),
            lambda: None,
            lambda _data, _now: received.put_nowait(unacknowledged(board)),
            lambda _: None,
            Traffic(),
        )
        task = loop.create_task(port.run())
        board, _ = await asyncio.wait_for(loop.sock_accept(listener), TIMEOUT_S)
        with board:
            left = []
            # Linux delays acknowledgements only on connections that carry traffic both ways.
            for _ in range(30):
                board.send(b"$")
                left.append(await asyncio.wait_for(received.get(), TIMEOUT_S))
                port.write(b"?")
                board.setblocking(True)
                assert board.recv(1) == b"?"
            assert left == [0] * 30
            task.cancel()
            await asyncio.wait([task])


async def test_a_connection_that_confirms_nothing_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """Here the other end's buffer is full; an adapter that lost its Wi-Fi is as silent."""
    monkeypatch.setattr("service.links.fc_device._TCP_STALL_MS", 100)
    loop = asyncio.get_running_loop()
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        listener.setblocking(False)
        lost = loop.create_future()
        port = FcPort(
            device_opener(TcpFc("127.0.0.1", listener.getsockname()[1])),
            lambda: None,
            lambda _data, _now: None,
            lambda why: None if lost.done() else lost.set_result(why),
            Traffic(),
        )
        task = loop.create_task(port.run())
        board, _ = await asyncio.wait_for(loop.sock_accept(listener), TIMEOUT_S)
        async with asyncio.timeout(TIMEOUT_S):
            while not port.dropped_bytes:
                port.write(bytes(4096))
                await asyncio.sleep(0)
            assert await lost == "Connection timed out"
        board.close()
        task.cancel()
        await asyncio.wait([task])
