"""The flight controller's port: opened, read, written, and opened again whenever it comes back."""

import asyncio
import os
import socket
import termios
from collections.abc import Callable
from typing import Protocol

import serial
import structlog

from service.connection import FcAddress, SerialFc, SimulatedFc, TcpFc
from service.port_holder import explain_port_error, find_console
from service.simulator.naze import SimulatedNaze
from service.simulator.options import SimOptions
from service.simulator.pipe_link import SimLink

_READ_SIZE = 4096
_RETRY_S = 0.25
#: More unsent bytes than this mean that the other end has stopped reading.
_MAX_UNSENT = 8192

_log = structlog.get_logger()


class _Device(Protocol):
    """An open port: a file descriptor, and a speed where it has one."""

    def fileno(self) -> int: ...
    def close(self) -> None: ...


class PortError(Exception):
    """The port cannot be opened now; the text is one sentence for the user."""


class FcPort:
    """Keeps the port open. `on_open`, `on_data` and `on_close` are called from the event loop.

    The first failure to open is a warning, the same one again is not told twice.
    """

    def __init__(
        self,
        address: FcAddress,
        on_open: Callable[[], None],
        on_data: Callable[[bytes], None],
        on_close: Callable[[str], None],
    ) -> None:
        self._address = address
        self._on_open = on_open
        self._on_data = on_data
        self._on_close = on_close
        self._loop = asyncio.get_running_loop()
        self._device: _Device | None = None
        self._speed: int | None = None
        self._unsent = bytearray()
        self._closed = asyncio.Event()
        self._last_complaint = ""
        #: Its list outlives a reopened port, as the real board's does.
        self._simulated = SimulatedNaze(SimOptions()) if isinstance(address, SimulatedFc) else None

    async def run(self) -> None:
        """Open the port and open it again for ever; cancel to end."""
        try:
            while True:
                try:
                    self._device = await self._open()
                except (PortError, OSError) as error:
                    self._complain(str(error))
                    await asyncio.sleep(_RETRY_S)
                    continue
                self._last_complaint = ""
                self._closed.clear()
                self._loop.add_reader(self._device.fileno(), self._readable)
                self._on_open()
                await self._closed.wait()
        finally:
            self._shut("the daemon stops")

    def set_speed(self, baud: int | None) -> None:
        """Run the port at another speed, baud."""
        if baud is None or baud == self._speed or not isinstance(self._device, serial.Serial):
            return
        self._speed = baud
        try:
            self._device.baudrate = baud
        except (OSError, serial.SerialException, termios.error) as error:
            self._shut(str(error))

    def write(self, data: bytes) -> None:
        """Write without ever waiting; what does not fit now goes out when the port takes it."""
        if self._device is None:
            return
        if self._unsent:
            self._unsent += data
            if len(self._unsent) > _MAX_UNSENT:
                self._shut("the port takes no more bytes")
            return
        sent = self._try_write(data)
        if sent < len(data) and self._device is not None:
            self._unsent += data[sent:]
            self._loop.add_writer(self._device.fileno(), self._writable)

    def _try_write(self, data: bytes | bytearray) -> int:
        assert self._device is not None
        try:
            return os.write(self._device.fileno(), data)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError as error:
            self._shut(error.strerror or str(error))
            return len(data)

    def _writable(self) -> None:
        if self._device is None:
            return
        sent = self._try_write(self._unsent)
        del self._unsent[:sent]
        if not self._unsent and self._device is not None:
            self._loop.remove_writer(self._device.fileno())

    def _readable(self) -> None:
        assert self._device is not None
        try:
            data = os.read(self._device.fileno(), _READ_SIZE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._shut(error.strerror or str(error))
            return
        if not data:
            self._shut("the other end hung up")
            return
        self._on_data(data)

    def _shut(self, why: str) -> None:
        device, self._device = self._device, None
        if device is None:
            return
        self._loop.remove_reader(device.fileno())
        self._loop.remove_writer(device.fileno())
        self._unsent.clear()
        self._speed = None
        device.close()
        self._closed.set()
        self._on_close(why)

    def _complain(self, why: str) -> None:
        level = _log.debug if why == self._last_complaint else _log.warning
        level("fc.port_unavailable", why=why)
        self._last_complaint = why

    async def _open(self) -> _Device:
        if self._simulated is not None:
            return await SimLink(self._simulated, self._loop).start()
        if isinstance(self._address, TcpFc):
            return await _open_tcp(self._address.host, self._address.port)
        assert isinstance(self._address, SerialFc)
        return open_serial(self._address.path)


def open_serial(path: str) -> serial.Serial:
    """Open a serial port for us alone; PortError says why not."""
    console = find_console(path)
    if console:
        raise PortError(
            f"{path} is taken by a login console: sudo systemctl disable --now serial-getty@{console}.service,"
            " and take console=... for it out of cmdline.txt"
        )
    try:
        port = serial.Serial(path, 115200, timeout=0, write_timeout=0, exclusive=True)
    except (serial.SerialException, OSError) as error:
        raise PortError(explain_port_error(path, error)) from error
    except termios.error as error:
        raise PortError(f"{path} is no serial port") from error
    os.set_blocking(port.fileno(), False)
    return port


async def _open_tcp(host: str, port: int) -> socket.socket:
    connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    connection.setblocking(False)
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(3):
            found = await loop.getaddrinfo(host, port, family=socket.AF_INET, type=socket.SOCK_STREAM)
            await loop.sock_connect(connection, found[0][4])
    except (OSError, TimeoutError) as error:
        connection.close()
        reason = error.strerror or str(error) or "no answer"
        raise PortError(f"tcp:{host}:{port} cannot be reached: {reason}") from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection
