# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations behind a telemetry radio (SiK) on a serial port."""

import asyncio
import os
from collections import deque
from contextlib import suppress
from functools import partial

import serial
import structlog

from bridge.gcs.station import Peer
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkSplitter
from service.links.fc_device import DEVICE_ERRORS, PortError, open_serial
from service.links.gcs_events import GcsEvents
from service.links.tcp_link import must_arrive
from service.machine.log_setup import warn_once
from service.machine.threads import BackgroundThread
from service.settings.addresses import GcsAddress
from storage.os_error import reason

_READ_SIZE = 512
_REOPEN_S = 1.0
#: The part of the serial rate that is used. The radio's own rate in the air may be lower: then the buffer fills, and it
#: says so in RADIO_STATUS.txbuf (percent free).
_SHARE, _LEAST_SHARE = 0.8, 0.1
_FULL, _EMPTY = 33, 90
#: Telemetry is dropped while more than this is waiting to be sent, other frames above the larger limit; seconds.
_LATE_S, _MOST_S = 0.3, 20.0

_log = structlog.get_logger()


class SerialLink:
    """One peer. The bytes are sent at most at the port's rate. The port is reopened whenever it comes back."""

    def __init__(self, address: GcsAddress, events: GcsEvents) -> None:
        self.name = str(address)
        self._address = address
        self._events = events
        self._loop = asyncio.get_running_loop()
        self._peer = Peer(self.name, address.host)
        self._bytes_per_s = address.port / 10
        self._share = _SHARE
        self._port: serial.Serial | None = None
        self._frames = MavlinkSplitter()
        self._waiting: deque[bytes] = deque()
        self._free_at = 0.0
        self._warned: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._thread = BackgroundThread("telemetry radio")
        self._opening: asyncio.Task[None] | None = None
        self._begin_to_open()

    def send(self, peer: Peer, data: bytes) -> None:
        if self._port is None:
            return
        late_s = (sum(map(len, self._waiting)) + len(data)) / (self._bytes_per_s * self._share)
        if late_s > _MOST_S or (late_s > _LATE_S and not must_arrive(data)):
            return
        self._waiting.append(data)
        if len(self._waiting) == 1:
            self._write_when_free()

    def close(self) -> None:
        if self._opening is not None:
            self._opening.cancel()
        if self._timer is not None:
            self._timer.cancel()
        if self._port is not None:
            self._loop.remove_reader(self._port.fileno())
            with suppress(*DEVICE_ERRORS):
                self._port.close()

    def _begin_to_open(self) -> None:
        self._opening = self._loop.create_task(self._open())

    async def _open(self) -> None:
        try:
            self._port = await self._thread.ask(partial(open_serial, self._address.host))
            self._port.baudrate = self._address.port
        except (PortError, *DEVICE_ERRORS) as error:
            self._port = None
            self._warn(error)
            self._timer = self._loop.call_later(_REOPEN_S, self._begin_to_open)
            return
        _log.info("gcs.port_open", link=self.name)
        self._warned.clear()
        self._loop.add_reader(self._port.fileno(), self._readable)
        # Like a TCP client, a station behind a radio hears the vehicle from the start.
        self._events.add_default_peer(self._peer)

    def _warn(self, error: Exception) -> None:
        path = self._address.host
        why = reason(error) if os.path.exists(path) else f"{path} is missing: plug the radio in"
        warn_once(self._warned, "gcs.unavailable", link=self.name, why=why)

    def _lost(self, why: str) -> None:
        self.close()
        self._port = None
        self._waiting.clear()
        self._frames, self._share = MavlinkSplitter(), _SHARE
        warn_once(self._warned, "gcs.unavailable", link=self.name, why=why)
        self._events.remove_default_peer(self._peer)
        self._events.gcs_gone(self._peer)
        self._timer = self._loop.call_later(_REOPEN_S, self._begin_to_open)

    def _readable(self) -> None:
        assert self._port is not None
        try:
            data = os.read(self._port.fileno(), _READ_SIZE)
        except BlockingIOError:
            return
        except OSError as error:
            self._lost(reason(error))
            return
        if not data:
            self._lost("it was unplugged")
            return
        taken = []
        for frame in self._frames.feed(data):
            if frame.msgid == messages.MAVLINK_MSG_ID_RADIO_STATUS:
                self._adapt(frame.payload.ljust(9, b"\0")[6])
            else:
                taken.append(frame.raw)
        if taken:
            self._events.gcs_data(self._peer, b"".join(taken), datagram=False)

    def _adapt(self, free_percent: int) -> None:
        """Send less while the radio's buffer is full, as ArduPilot does."""
        if free_percent < _FULL:
            self._share = max(self._share * 0.7, _LEAST_SHARE)
        elif free_percent > _EMPTY:
            self._share = min(self._share * 1.1, _SHARE)

    def _write_when_free(self) -> None:
        self._timer = self._loop.call_at(max(self._free_at, self._loop.time()), self._write)

    def _write(self) -> None:
        assert self._port is not None
        data = self._waiting[0]
        try:
            sent = os.write(self._port.fileno(), data)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            self._lost(reason(error))
            return
        self._free_at = self._loop.time() + max(sent, 1) / (self._bytes_per_s * self._share)
        if sent == len(data):
            self._waiting.popleft()
        else:
            self._waiting[0] = data[sent:]
        if self._waiting:
            self._write_when_free()
