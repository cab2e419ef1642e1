# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's port: opened, read, written, and reopened whenever it comes back."""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, closing, suppress
from math import inf

import serial
import structlog

from service.links.fc_device import DEVICE_ERRORS, Device, PortError, PortInUseError, send_last_frame
from service.links.traffic import Traffic
from service.machine.event_loop import EventLoop
from storage.os_error import reason

#: The reason given to `on_close` at the end of the daemon.
STOPPED = "the daemon stops"
MOVED_ON = "searching for the flight controller on another port"
LENT = "the port is used for new firmware"

_READ_SIZE = 4096
_RETRY_S = 0.25
#: A search through all processes four times a second would take a sixth of a core.
_IN_USE_RETRY_S = 2.0
#: Unsent bytes above this are dropped: ground stations can send faster than a UART.
_MAX_UNSENT = 8192
#: So many reads within a window are gathered from then on, several a wake-up: telemetry that is a few ms older costs
#: the pilot less than the wake-ups cost the CPU.
_MANY_READS, _WINDOW_S = 25, 0.25
#: A little less than a datagram holds (bridge/gcs/ground.py): two cost twice as much.
_GATHERED_SIZE = 250
_SHORTEST_DELAY_S, _LONGEST_DELAY_S = 0.002, 0.012
#: Gathering with a long delay ends at a read of so many bytes.
_MUCH = 1024
#: Any gathering ends after such a window with less than this part of the rate at its start.
_LONG_WINDOW_S, _LEAST_PART = 1.0, 0.4
#: After a request, replies are read without delay for this long.
_REPLIES_S = 0.25

_log = structlog.get_logger()


class FcPort:
    """Keeps the port open. `open_device` raises PortError if it cannot be opened now.

    `on_open`, `on_data` and `on_close` are called from the event loop. Reads are counted in `traffic`.

    The first failure to open is logged as a warning; a repetition is not logged again.
    """

    def __init__(
        self,
        open_device: Callable[[], Awaitable[Device]],
        on_open: Callable[[], None],
        on_data: Callable[[bytes, float], None],
        on_close: Callable[[str], None],
        traffic: Traffic,
    ) -> None:
        self._open = open_device
        self._on_open = on_open
        self._on_data = on_data
        self._on_close = on_close
        self._traffic = traffic
        self._loop = asyncio.get_running_loop()
        self._device: Device | None = None
        self._descriptor = -1
        self._is_tcp = False
        self._speed: int | None = None
        self._unsent = bytearray()
        self._closed = asyncio.Event()
        # Held by `run` while the port is open, or by a borrower.
        self._use = asyncio.Lock()
        #: True while a borrower uses the port, or waits for it.
        self.is_lent = False
        #: Why the port cannot be opened; empty once it is open.
        self.trouble = ""
        #: Bytes dropped because the line was too slow.
        self.dropped_bytes = 0
        #: Reads may be delayed by a few ms, unless a reply is pending.
        self.may_gather = False
        self._is_gathering = False
        self._gathers_from = 0.0
        self._window_began = 0.0
        self._window_bytes = 0  # received before it
        self._next_look = self._reads_until_look = _MANY_READS
        self._bytes_per_s = 0.0  # when gathering began
        self._most = inf

    async def run(self) -> None:
        """Open the port and keep reopening it; cancel to end."""
        try:
            while True:
                async with self._use:
                    pause_s = await self._open_once()
                    if self.is_lent:
                        self._shut(LENT)
                    if self._device is not None:
                        await self._closed.wait()
                # Also after a loss: a TCP adapter in use accepts each connection and closes it at once.
                await asyncio.sleep(pause_s)
        finally:
            self._shut(STOPPED)

    async def _open_once(self) -> float:
        """Try to open the port; the pause before the next attempt, s."""
        try:
            self._device = await self._open()
        except (PortError, OSError) as error:
            level = _log.debug if str(error) == self.trouble else _log.warning
            level("fc.port_unavailable", why=str(error))
            self.trouble = str(error)
            return _IN_USE_RETRY_S if isinstance(error, PortInUseError) else _RETRY_S
        self._descriptor = self._device.fileno()
        self._is_tcp = isinstance(self._device, socket.socket) and self._device.family != socket.AF_UNIX
        self.trouble = ""
        self._closed.clear()
        self._loop.add_reader(self._descriptor, self._readable)
        self._on_open()
        return _RETRY_S

    @asynccontextmanager
    async def lend(self) -> AsyncIterator[None]:
        """Keep the port closed, so that the caller may open it; afterwards it is opened again."""
        self.is_lent = True
        try:
            self._shut(LENT)
            async with self._use:
                yield
        finally:
            self.is_lent = False

    def move_on(self) -> None:
        """Close the port. It is reopened, and `open_device` may choose another one."""
        self._shut(MOVED_ON)

    def set_speed(self, baud: int | None) -> None:
        """Change the speed, baud. Unsent bytes are dropped: at the new speed they would be misread."""
        if baud is None or baud == self._speed or not isinstance(self._device, serial.Serial):
            return
        self._speed = baud
        self._unsent.clear()
        try:
            self._device.reset_output_buffer()
            self._device.baudrate = baud
        except DEVICE_ERRORS as error:
            self._shut(str(error))

    def write(self, data: bytes, *, asks: bool = False) -> None:
        """Write without blocking; the rest is sent when the port is writable. `asks`: a reply is expected."""
        if self._device is None:
            return
        if asks and (self.may_gather or self._is_gathering):
            self._gathers_from = self._loop.time() + _REPLIES_S
            self._read_at_once()
        if self._unsent:
            if len(self._unsent) + len(data) > _MAX_UNSENT:
                self.dropped_bytes += len(data)
                return
            self._unsent += data
            return
        sent = self._try_write(data)
        if sent < len(data) and self._device is not None:
            self._unsent += data[sent:]
            self._loop.add_writer(self._descriptor, self._writable)

    def _try_write(self, data: bytes | bytearray) -> int:
        try:
            return os.write(self._descriptor, data)
        except BlockingIOError:
            return 0
        except OSError as error:
            self._shut(reason(error))
            return len(data)

    def _writable(self) -> None:
        sent = self._try_write(self._unsent)
        del self._unsent[:sent]
        if not self._unsent and self._device is not None:
            self._loop.remove_writer(self._descriptor)

    def _readable(self) -> None:
        self._read(self._loop.time())

    def _read(self, now: float) -> None:
        try:
            data = os.read(self._descriptor, _READ_SIZE)
        except BlockingIOError:
            # Gathering: nothing has arrived.
            self._judge_rate(now)
            return
        except OSError as error:
            self._shut(reason(error))
            return
        if not data:
            self._shut("the other end closed the connection")
            return
        traffic = self._traffic
        traffic.pieces_received += 1
        traffic.bytes_received += len(data)
        if self._is_tcp:
            self._acknowledge()
        if len(data) > self._most:
            self._read_at_once()  # until the new rate is known
        elif traffic.pieces_received >= self._next_look:
            self._judge_rate(now)
        self._on_data(data, now)

    def _judge_rate(self, now: float) -> None:
        """Begin to gather after many reads in a short time; end it when less has arrived for longer."""
        window_s, size = now - self._window_began, self._traffic.bytes_received - self._window_bytes
        if self._is_gathering:
            if window_s < _LONG_WINDOW_S:
                return
            if not self.may_gather or size < self._bytes_per_s * window_s * _LEAST_PART:
                self._read_at_once()
        elif window_s < _WINDOW_S and self.may_gather and now >= self._gathers_from:
            self._begin_gathering(size / window_s)
        self._window_began = now
        self._window_bytes = self._traffic.bytes_received
        self._next_look = self._traffic.pieces_received + self._reads_until_look

    def _begin_gathering(self, bytes_per_s: float) -> None:
        if isinstance(self._loop, EventLoop):
            delay_s = min(max(_GATHERED_SIZE / bytes_per_s, _SHORTEST_DELAY_S), _LONGEST_DELAY_S)
            self._is_gathering, self._bytes_per_s = True, bytes_per_s
            self._most = inf if delay_s < 2 * _SHORTEST_DELAY_S else _MUCH
            self._reads_until_look = int(_LONG_WINDOW_S / delay_s)
            self._loop.remove_reader(self._descriptor)
            self._loop.repeat(delay_s, self._read)

    def _read_at_once(self) -> None:
        if self._is_gathering:
            self._stop_gathering()
            self._loop.add_reader(self._descriptor, self._readable)

    def _stop_gathering(self) -> None:
        if self._is_gathering and isinstance(self._loop, EventLoop):
            self._is_gathering, self._most = False, inf
            self._reads_until_look = _MANY_READS
            self._next_look = self._traffic.pieces_received + _MANY_READS
            self._loop.stop_repeating()

    def _acknowledge(self) -> None:
        """Let the TCP connection acknowledge received bytes at once, not 40 ms later.

        INAV 6.1's simulator and cheap serial adapters send replies byte by byte, and wait for this after the first one.
        """
        assert isinstance(self._device, socket.socket)
        with suppress(OSError):
            self._device.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)

    def _shut(self, why: str) -> None:
        device, self._device = self._device, None
        if device is None:
            return
        self._stop_gathering()
        self._loop.remove_reader(self._descriptor)
        self._loop.remove_writer(self._descriptor)
        self._descriptor = -1
        self._unsent.clear()
        self._speed = None
        self._closed.set()
        with suppress(*DEVICE_ERRORS), closing(device):  # it is opened again in any case
            if isinstance(device, serial.Serial):
                send_last_frame(device)
        self._on_close(why)
