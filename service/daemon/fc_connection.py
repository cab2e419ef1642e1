# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's connection to the flight controller: the port is found, opened and counted."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, closing
from math import inf

import serial
import structlog

from bridge.bridge import Bridge
from bridge.effects import SendToBoard
from bridge.model.events import FcFound, FcInCommandLine, FcLost, PortLost
from service.links.fc_device import PortError, device_opener, open_serial
from service.links.fc_port import MOVED_ON, STOPPED, FcPort
from service.links.port_finder import PortFinder
from service.links.traffic import Traffic
from service.machine.host import Host
from service.settings import Settings
from service.settings.addresses import AutoFc, SerialFc, UdpFc

#: The interval of messages about an unsuccessful search: a silent log looks like a hang.
_SEARCH_REPORT_S = 60.0
#: The pause after a bug, before the port is opened again.
_RESTART_S = 1.0

_log = structlog.get_logger()


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
        self._search_report: asyncio.TimerHandle | None = None
        #: On the loop's clock; `found_at` None: no flight controller; `lost_at` None: none was lost since.
        self.found_at: float | None = None
        self.lost_at: float | None = None

    @property
    def trouble(self) -> str:
        """Why the flight controller cannot be used: the port, or the state, or empty if it can be."""
        return self._port.trouble or self._bridge.fc_trouble

    @property
    def where(self) -> str:
        """The port or address. While no port is open, the kinds of port searched."""
        return str(self._address) if self._finder is None else self._finder.where

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
        """Lend the serial port, at 115200 baud. Afterwards the flight controller is searched again. PortError."""
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
        """Stop the timers. The port closes with `run`."""
        if self._search_report is not None:
            self._search_report.cancel()
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
        self._report_search()

    def _received(self, data: bytes, now: float) -> None:
        if self._bridge.fc_received(data, now):
            self._flush()

    def _closed(self, why: str) -> None:
        self._bridge.fc_closed(self._loop.time(), None if why in (STOPPED, MOVED_ON) else why)
        self._flush()

    def _report_search(self) -> None:
        if self._search_report is not None:
            self._search_report.cancel()
        if self._bridge.is_searching:
            _log.info("fc.searching", fc=self.where)
        self._search_report = self._loop.call_later(_SEARCH_REPORT_S, self._report_search)
