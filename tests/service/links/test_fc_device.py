# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers behind TCP, one byte at a time, and behind UDP."""

import asyncio
import fcntl
import os
import socket
import struct
import termios

import pytest

from service.daemon.fc_connection import FcPort, Traffic
from service.links.fc_device import PortError, device_opener
from service.settings.addresses import TcpFc, parse_fc
from tests.support.programs import TIMEOUT_S, free_port


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


async def test_a_confirmed_connection_is_lossless(monkeypatch: pytest.MonkeyPatch) -> None:
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


@pytest.mark.parametrize("form", ["udp:127.0.0.1:{}", "udp://127.0.0.1:{}", "udpout:127.0.0.1:{}"])
async def test_a_board_behind_udp_is_asked_at_the_address(form: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as board:
        board.bind(("127.0.0.1", 0))
        device = await device_opener(parse_fc(form.format(board.getsockname()[1])))()
        os.write(device.fileno(), b"$M<")
        asked, sender = board.recvfrom(99)
        board.sendto(b"$M>", sender)
        assert (asked, os.read(device.fileno(), 99)) == (b"$M<", b"$M>")
        device.close()


@pytest.mark.parametrize("form", ["udpin:127.0.0.1:{}", "udp:0.0.0.0:{}", "udp://:{}", "udpin::{}"])
async def test_a_board_that_sends_first_is_answered_where_it_sends_from(form: str) -> None:
    port = free_port(socket.SOCK_DGRAM)
    opening = asyncio.ensure_future(device_opener(parse_fc(form.format(port)))())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as board, socket.socket(type=socket.SOCK_DGRAM) as other:
        board.setblocking(False)
        async with asyncio.timeout(TIMEOUT_S):
            while not opening.done():
                board.sendto(b"hello", ("127.0.0.1", port))
                await asyncio.sleep(0.01)
        device = await opening
        other.sendto(b"not the board", ("127.0.0.1", port))
        os.write(device.fileno(), b"$M<")
        assert await asyncio.get_running_loop().sock_recv(board, 99) == b"$M<"
        board.sendto(b"$M>", ("127.0.0.1", port))
        read = [os.read(device.fileno(), 99)]
        while read[-1] == b"hello":
            read.append(os.read(device.fileno(), 99))
        assert read[-1] == b"$M>"
        device.close()


async def test_a_silent_wifi_bridge_is_reported_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.links.fc_device._TIMEOUT_S", 0.01)
    port = free_port(socket.SOCK_DGRAM)
    with pytest.raises(PortError) as error:
        await device_opener(parse_fc(f"udpin:127.0.0.1:{port}"))()
    wanted = "no answer; make the Wi-Fi bridge send to this port, or use udp:HOST:PORT"
    assert str(error.value) == f"udpin:127.0.0.1:{port} cannot be reached: {wanted}"
