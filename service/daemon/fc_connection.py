# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's port: found, opened, read, written, and reopened whenever it comes back."""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, closing, suppress
from dataclasses import dataclass
from math import inf

import serial
import structlog

from bridge.bridge import Bridge
from bridge.effects import SendToBoard
from bridge.model.events import FcFound, FcInCommandLine, FcLost, PortLost
from service.links.fc_device import (
    DEVICE_ERRORS,
    Device,
    PortError,
    PortInUseError,
    device_opener,
    open_serial,
    send_last_frame,
)
from service.links.port_finder import PortFinder
from service.machine import event_loop
from service.machine.host import Host
from service.settings import Settings
from service.settings.addresses import AutoFc, SerialFc, UdpFc
from storage.os_error import reason

#: The pause after a bug, before the port is opened again.
_RESTART_S = 1.0
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
#: Passed-through data that arrives at this rate, bytes/s, is gathered: telemetry that is a few ms older costs the pilot
#: less than the wake-ups cost the CPU. Each read waits for a little less than a datagram holds (bridge/gcs/ground.py:
#: two cost twice as much), but for no longer than this.
_GATHERED_RATE, _GATHERED_SIZE = 2400, 220
_SHORTEST_DELAY_S, _LONGEST_DELAY_S = 0.002, 0.03
#: After a request, replies are read without delay for this long.
_REPLIES_S = 0.25

_log = structlog.get_logger()


@dataclass(slots=True)
class Traffic:
    """Bytes through a port or link since the start."""

    bytes_received: int = 0
    bytes_sent: int = 0


class FcPort:
    """Keeps the port open. `open_device` raises PortError if it cannot be opened now.

    `on_open`, `on_data` and `on_close` are called from the event loop. `traffic` counts the bytes read.

    The first failure to open is logged as a warning. A repetition is not logged again.
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
        self._loop = event_loop.running()
        self._lane = self._loop.lane
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
        self._gathers_from = self._read_at = -inf

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
        """Try to open the port. The pause before the next attempt, s."""
        try:
            self._device = await self._open()
        except (PortError, OSError) as error:
            level = _log.debug if str(error) == self.trouble else _log.warning
            level("fc.port_unavailable", why=str(error))
            self.trouble = str(error)
            return _IN_USE_RETRY_S if isinstance(error, PortInUseError) else _RETRY_S
        self._descriptor = self._device.fileno()
        device = self._device
        self._is_tcp = (
            isinstance(device, socket.socket) and device.family != socket.AF_UNIX and device.type == socket.SOCK_STREAM
        )
        self.trouble = ""
        self._closed.clear()
        self._lane.watch(self._descriptor, self._read)
        self._on_open()
        return _RETRY_S

    @asynccontextmanager
    async def lend(self) -> AsyncIterator[None]:
        """Keep the port closed, so that the caller may open it. Afterwards it is opened again."""
        self.is_lent = True
        try:
            self._shut(LENT)
            async with self._use:
                yield
        finally:
            self.is_lent = False

    def move_on(self) -> None:
        """Close the port. It is reopened, and `open_device` may choose another."""
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
        """Write without blocking. The rest is sent when the port is writable. `asks`: a reply is expected."""
        if self._device is None:
            return
        if asks:
            self._lane.hold(-inf)
            if self.may_gather:
                self._gathers_from = self._loop.time() + _REPLIES_S
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

    def hold(self, until: float) -> None:
        """Do not read before this time, unless something is written that asks for a reply."""
        if self._device is not None:
            self._lane.hold(until)

    def _read(self, now: float) -> None:
        try:
            data = os.read(self._descriptor, _READ_SIZE)
        except BlockingIOError:  # after a delay without input
            return
        except OSError as error:
            self._shut(reason(error))
            return
        if not data:
            self._shut("the other end closed the connection")
            return
        self._traffic.bytes_received += len(data)
        if self._is_tcp:
            self._acknowledge()
        if self.may_gather:
            self._gather(len(data), now)
        self._on_data(data, now)

    def _gather(self, size: int, now: float) -> None:
        """Delay the next read if the last brought much for the time since the one before."""
        since_s, self._read_at = now - self._read_at, now
        if size >= _GATHERED_RATE * since_s and now >= self._gathers_from:
            self._lane.hold(now + min(max(_GATHERED_SIZE / size * since_s, _SHORTEST_DELAY_S), _LONGEST_DELAY_S))

    def _acknowledge(self) -> None:
        """Let the TCP connection acknowledge received bytes at once, not 40 ms later.

        INAV 6.1's simulator and cheap serial adapters send replies byte by byte, and wait for this after the first.
        """
        assert isinstance(self._device, socket.socket)
        with suppress(OSError):
            self._device.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)

    def _shut(self, why: str) -> None:
        device, self._device = self._device, None
        if device is None:
            return
        self._lane.unwatch()
        self._loop.remove_writer(self._descriptor)
        self._descriptor = -1
        self._unsent.clear()
        self._speed = None
        self._closed.set()
        with suppress(*DEVICE_ERRORS), closing(device):  # it is opened again in any case
            if isinstance(device, serial.Serial):
                send_last_frame(device)
        self._on_close(why)


class FcConnection:
    """Feeds the port's bytes to the bridge. `flush` carries out the bridge's effects."""

    def __init__(
        self,
        settings: Settings,
        host: Host,
        bridge: Bridge,
        traffic: Traffic,
        flush: Callable[[], None],
    ) -> None:
        self._address = settings.fc
        self._name = str(settings.fc)
        self._bridge = bridge
        self._traffic = traffic
        self._flush = flush
        self._loop = asyncio.get_running_loop()
        self._finder: PortFinder | None = None
        if isinstance(self._address, AutoFc):
            self._finder = PortFinder(host, settings.state_dir, [each.host for each in settings.gcs if each.is_serial])
        open_device = device_opener(self._address) if self._finder is None else self._finder.open
        self._port = FcPort(open_device, self._opened, self._received, self._closed, traffic)
        if self._finder is not None:
            self._finder.move_on = self._port.move_on
        self._speed: int | None = None
        # While replies to polls are gathered.
        self._is_held = False
        #: On the loop's clock; `found_at` None without a flight controller; `lost_at` None: none was lost since.
        self.found_at: float | None = None
        self.lost_at: float | None = None

    @property
    def trouble(self) -> str:
        """Why the flight controller cannot be used: the port, or the state, or empty if it can be."""
        return self._port.trouble or self._bridge.fc_trouble

    @property
    def where(self) -> str:
        """The port or address. Before a port is open, the kinds of port searched."""
        return self._name if self._finder is None else self._finder.where

    @property
    def dropped_bytes(self) -> int:
        """Bytes dropped because the line was too slow."""
        return self._port.dropped_bytes

    def ports(self) -> dict[str, object]:
        """With `fc = "auto"`, for the status: the port in use, and those skipped with the reasons."""
        return {} if self._finder is None else self._finder.status()

    async def run(self) -> None:
        """Keep the port open, even after a bug; cancel to end."""
        task = asyncio.current_task()
        assert task is not None
        while not task.cancelling():  # a bug while the port closes replaces the CancelledError
            try:
                await self._port.run()
            except Exception:
                _log.exception("daemon.fault", what="the flight controller's port")
                await asyncio.sleep(_RESTART_S)

    @property
    def is_lent(self) -> bool:
        """True while new firmware is flashed."""
        return self._port.is_lent

    @asynccontextmanager
    async def lend(self) -> AsyncIterator[serial.Serial]:
        """Lend the serial port, at 115200 baud. Afterwards the flight controller is searched for again. PortError."""
        if not isinstance(self._address, SerialFc | AutoFc):
            raise PortError(f"{self._address} is not a serial port")
        async with self._port.lend():
            if isinstance(self._address, SerialFc):
                path = self._address.path
            else:
                assert self._finder is not None
                path = self._finder.port_of_silent_board()
            with closing(open_serial(path)) as device:
                yield device

    def close(self) -> None:
        """Stop the search. The port closes with `run`."""
        if self._finder is not None:
            self._finder.close()

    def carry_out(self, output: SendToBoard) -> None:
        if output.speed != self._speed:
            self._speed = output.speed
            self._port.set_speed(output.speed)
        self._port.may_gather = output.may_gather
        if output.data:
            data = b"".join(output.data)
            self._port.write(data, asks=output.asks)
            self._traffic.bytes_sent += len(data)
        if output.complete_at > -inf or self._is_held:
            self._is_held = output.complete_at > -inf
            self._port.hold(output.complete_at)

    def happened(self, event: FcFound | FcLost | PortLost | FcInCommandLine) -> None:
        if self._finder is not None:
            self._finder.happened(event)
        if isinstance(event, FcFound):
            self.found_at, self.lost_at = self._loop.time(), None
        elif self.found_at is not None:
            self.found_at, self.lost_at = None, self._loop.time()
            if isinstance(self._address, UdpFc):
                # A Wi-Fi bridge that restarted may have another address or port.
                self._loop.call_soon(self._port.move_on)

    def _opened(self) -> None:
        self._bridge.fc_opened(self._loop.time())
        self._flush()
        _log.info("fc.searching", fc=self.where)

    def _received(self, data: bytes, now: float) -> None:
        if self._bridge.fc_received(data, now):
            self._flush()

    def _closed(self, why: str) -> None:
        self._bridge.fc_closed(self._loop.time(), None if why in (STOPPED, MOVED_ON) else why)
        self._flush()
