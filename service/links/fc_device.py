# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens the connection to a flight controller: a serial port, TCP, UDP, or the simulated Naze."""

import asyncio
import os
import socket
import termios
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any, Protocol

import serial

from protocols.remedies import Fault
from service.links.port_holder import BUSY, explain_port_error, find_console
from service.machine.threads import BackgroundThread
from service.settings.addresses import AutoFc, FcAddress, SerialFc, TcpFc, UdpFc, bindable, family_of
from storage.os_error import reason

#: Errors of an open port: pyserial raises the last two if it is unplugged, or the driver refuses the speed.
DEVICE_ERRORS = (OSError, termios.error, ValueError)
#: A poll takes 75 ms at 1200 baud.
_LAST_FRAME_S = 0.1
_TIMEOUT_S = 3.0
#: A connection without a confirmation for this long is lost. After a gap in the Wi-Fi a new connection carries data at
#: once. The old one might wait for as long again as the gap was.
_TCP_STALL_MS = 5000


class Device(Protocol):
    """An open device: a non-blocking file descriptor."""

    def fileno(self) -> int:
        """The descriptor."""

    def close(self) -> None:
        """Close the descriptor."""


class PortError(Exception):
    """The device cannot be opened now. The text is one sentence for the user."""


class PortInUseError(PortError):
    """Another program uses the device. To name it, all processes are searched."""


def device_opener(address: FcAddress) -> Callable[[], Awaitable[Device]]:
    """A function that opens the device, and reopens it after a loss. For AutoFc see PortFinder."""
    assert not isinstance(address, AutoFc)
    if isinstance(address, SerialFc):
        return partial(BackgroundThread("serial port").ask, partial(open_serial, address.path))
    if isinstance(address, TcpFc):
        return partial(_open_tcp, address, BackgroundThread("name lookup"))
    if isinstance(address, UdpFc):
        return partial(_open_udp, address, BackgroundThread("name lookup"))
    # Imported only here: a daemon on a real flight controller does not need a simulator in memory.
    from simulator.links.pipe_link import SimLink
    from simulator.naze.board import SimulatedNaze

    # One board for all openings: the mission survives a lost port, as a real board's does.
    return SimLink(SimulatedNaze(), asyncio.get_running_loop()).start


def open_serial(path: str) -> serial.Serial:
    """Open a serial port for exclusive use. PortError if that fails. It searches all processes for a login console."""
    console = find_console(path)
    if console is not None:
        raise PortInUseError(
            f"{path} is used by a login console: sudo systemctl disable --now serial-getty@{console}.service,"
            " and remove its console=... from cmdline.txt"
        )
    try:
        # VMIN 1, which pyserial calls inter_byte_timeout: with 0 an empty read returns as if the other end had closed
        # the line.
        port = serial.Serial(path, 115200, timeout=0, write_timeout=0, inter_byte_timeout=0, exclusive=True)
        _keep_dtr(port.fileno())
        with suppress(*DEVICE_ERRORS):  # few drivers have this mode
            # Without it an FT232R keeps a short reply for 16 ms, in case more bytes follow.
            port.set_low_latency_mode(True)
    except (serial.SerialException, OSError) as error:
        kind = PortInUseError if error.errno in BUSY else PortError
        raise kind(explain_port_error(path, error)) from error
    except termios.error as error:
        raise PortError(f"{path} is not a serial port") from error
    os.set_blocking(port.fileno(), False)
    return port


def send_last_frame(port: serial.Serial) -> None:
    """Let a frame end before the port closes: after half a frame a board reads the next requests as the rest of it.

    Then drop the rest. The kernel, and the event loop, would wait up to 30 s for a board that does not accept bytes.
    """
    end = time.monotonic() + _LAST_FRAME_S
    while port.out_waiting and time.monotonic() < end:
        time.sleep(_LAST_FRAME_S / 20)
    port.reset_output_buffer()


def _keep_dtr(descriptor: int) -> None:
    """Keep DTR on when the port closes: an Arduino with MultiWii resets when it is raised again, even in flight."""
    attributes = termios.tcgetattr(descriptor)
    attributes[2] &= ~termios.HUPCL
    termios.tcsetattr(descriptor, termios.TCSANOW, attributes)


async def _open_tcp(address: TcpFc, resolver: BackgroundThread) -> socket.socket:
    family = family_of(address.host)
    with ExitStack() as unless_connected:
        connection = unless_connected.enter_context(socket.socket(family, socket.SOCK_STREAM))
        connection.setblocking(False)
        with _explained(address, "is it switched on, and is the port right?"):
            async with asyncio.timeout(_TIMEOUT_S):
                found = await _look_up(address, resolver)
                await asyncio.get_running_loop().sock_connect(connection, found)
        unless_connected.pop_all()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _TCP_STALL_MS)
    return connection


async def _open_udp(address: UdpFc, resolver: BackgroundThread) -> socket.socket:
    """A socket connected to the Wi-Fi bridge: the kernel drops datagrams of others."""
    with ExitStack() as unless_connected:
        connection = unless_connected.enter_context(socket.socket(family_of(address.host), socket.SOCK_DGRAM))
        connection.setblocking(False)
        hint = "make the Wi-Fi bridge send to this port, or use udp:HOST:PORT" if address.listens else ""
        with _explained(address, hint):
            async with asyncio.timeout(_TIMEOUT_S):
                if address.listens:
                    connection.bind(bindable(address.host, address.port))
                    _, peer = await asyncio.get_running_loop().sock_recvfrom(connection, 0)
                else:
                    peer = await _look_up(address, resolver)
                connection.connect(peer)
        unless_connected.pop_all()
    return connection


async def _look_up(address: TcpFc | UdpFc, resolver: BackgroundThread) -> Any:
    return (await resolver.ask(partial(socket.getaddrinfo, address.host, address.port, family_of(address.host))))[0][4]


@contextmanager
def _explained(address: TcpFc | UdpFc, hint: str) -> Iterator[None]:
    """Convert an error to PortError."""
    try:
        yield
    except (OSError, TimeoutError) as error:
        why = reason(error) or "no answer"
        if isinstance(error, socket.gaierror):
            _, hint = Fault.UNKNOWN_HOST(why="")
        raise PortError(f"{address} cannot be reached: {why}" + f"; {hint}" * bool(hint)) from error
