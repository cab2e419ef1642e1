# SPDX-License-Identifier: GPL-3.0-or-later
"""`fc = "auto"`: opens serial ports in turn until a flight controller is found.

The flight controller's last port is probed at once. Any other is first listened to. A port that another program uses is
not opened, and one that turned out to be a GPS receiver or a radio is not opened again.
"""

import asyncio
import os
from collections.abc import Callable, Collection
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import serial
import structlog

from bridge.fc.port_listener import PortListener
from bridge.model.events import BridgeEvent, FcFound, FcInCommandLine, FcLost
from service.links.fc_device import DEVICE_ERRORS, PortError, open_serial
from service.links.port_holder import find_user
from service.links.serial_ports import SerialPort, serial_ports
from service.machine.host import Host
from service.machine.state_file import StateFile
from storage.os_error import reason

PORTS_FILE = "ports.json"
#: The search visits all speeds within this time.
_SEARCH_S = 9.0
#: How long to wait for a lost flight controller: a Harakiri that looks for the GPS boots for 25 s.
_RETURN_S = 40.0
_RETRY_S = 1.0
_READ_SIZE = 4096

_log = structlog.get_logger()


class PortMemory:
    """Ports by their key (see SerialPort). Without a `folder` they are remembered until the program ends."""

    def __init__(self, folder: Path | None) -> None:
        self._file = StateFile(folder, PORTS_FILE, "every port is searched again")
        self.close = self._file.close
        #: The last port of the flight controller, or empty at first.
        self.flight_controller = ""
        #: Ports to skip, and the device found on each.
        self.others: dict[str, str] = {}
        self._file.load(self._read)

    def found_flight_controller(self, key: str) -> None:
        if key != self.flight_controller:
            self.flight_controller = key
            self.others.pop(key, None)
            self._save()

    def found_other(self, key: str, what: str) -> None:
        if self.others.get(key) != what:
            self.others[key] = what
            if self.flight_controller == key:
                self.flight_controller = ""
            self._save()

    def _read(self, kept: Any) -> None:
        others = {str(key): str(what) for key, what in kept["others"].items()}
        self.flight_controller, self.others = str(kept["flight_controller"]), others

    def _save(self) -> None:
        self._file.save({"flight_controller": self.flight_controller, "others": self.others})


class PortFinder:
    """Opens ports (`open`), follows the daemon's events, and moves on if no flight controller is found.

    `move_on()` must close the current port, so that `open` is called again. `radios`: ports of other links.
    """

    def __init__(self, host: Host, state_dir: Path | None, radios: Collection[str] = ()) -> None:
        self._host = host
        self._radios = {str(host.resolve(path)) for path in radios}
        self._loop = asyncio.get_running_loop()
        self._memory = PortMemory(state_dir)
        self._present: SerialPort | None = None
        self._tried: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        #: Why each port was skipped, by the path.
        self._passed: dict[str, str] = {}
        self.move_on: Callable[[], None] = lambda: None

    @property
    def where(self) -> str:
        """The open port, or the kind of device searched for."""
        return "the serial ports" if self._present is None else self._present.path

    async def open(self) -> serial.Serial:
        """Open the next port that may have a flight controller. Raises PortError if there is none now."""
        self._leave()
        for port in self._in_turn():
            self._tried.add(port.key)
            try:
                device = await self._try(port)
            except PortError as error:
                self._pass_over(port, str(error))
                continue
            self._present = port
            self._wait(_RETURN_S if port.key == self._memory.flight_controller else _SEARCH_S)
            return device
        self._tried.clear()
        await asyncio.sleep(_RETRY_S)
        if self._passed:
            raise PortError("; ".join(self.status()["ports_passed_over"]))
        raise PortError("there is no serial port: plug the flight controller in, or enable the UART on the header")

    def port_of_silent_board(self) -> str:
        """The port of a flight controller that need not answer: the last, or the only one. PortError."""
        ports = serial_ports(self._host)
        for port in ports:
            if port.key == self._memory.flight_controller:
                return port.path
        found = [port.path for port in ports if port.key not in self._memory.others]
        if len(found) != 1:
            which = f"one of {', '.join(found)}" if found else "none was found"
            raise PortError(f"it is not known which port the flight controller is on ({which}): name it (fc)")
        return found[0]

    def close(self) -> None:
        self._leave()
        self._memory.close()

    def happened(self, event: BridgeEvent) -> None:
        """Remember the flight controller's port. Wait for a lost one to come back."""
        if self._present is None:
            return
        if isinstance(event, FcFound | FcInCommandLine):
            self._stop_waiting()
            self._passed.pop(self._present.path, None)
            self._memory.found_flight_controller(self._present.key)
        elif isinstance(event, FcLost):
            self._wait(_RETURN_S)

    def status(self) -> dict[str, Any]:
        """The port in use, and those skipped with the reasons."""
        present = None if self._present is None else self._present.path
        skipped = [f"{path}: {why}" for path, why in sorted(self._passed.items()) if path != present]
        return {"port": present, "ports_passed_over": skipped}

    def _in_turn(self) -> list[SerialPort]:
        """The ports not tried in this round, the flight controller's last port first."""
        ports = [port for port in serial_ports(self._host) if str(self._host.resolve(port.path)) not in self._radios]
        there = {port.path for port in ports}
        self._passed = {path: why for path, why in self._passed.items() if path in there}
        left = [port for port in ports if port.key not in self._tried]
        if not left:
            self._tried.clear()
            left = ports
        return sorted(left, key=lambda port: port.key != self._memory.flight_controller)

    async def _try(self, port: SerialPort) -> serial.Serial:
        """Open a port that may have a flight controller. PortError says why it is skipped."""
        if (other := self._memory.others.get(port.key)) is not None:
            raise PortError(f"{other} was heard there")
        if (user := find_user(self._host, port.path)) is not None:
            raise PortError(f"{user} uses it")
        device = open_serial(str(self._host.path(port.path)))
        with ExitStack() as unless_used:
            unless_used.callback(device.close)
            try:
                what = "" if port.key == self._memory.flight_controller else await self._listen(device)
            except DEVICE_ERRORS as error:
                raise PortError(reason(error)) from error
            if what:
                self._memory.found_other(port.key, what)
                raise PortError(f"{what} was heard there")
            unless_used.pop_all()
        return device

    async def _listen(self, device: serial.Serial) -> str:
        """The other device recognised on the port, or empty if none. Does not send anything."""
        listener = PortListener(self._loop.time())
        readable = asyncio.Event()
        self._loop.add_reader(device.fileno(), readable.set)
        try:
            while not listener.is_done:
                if device.baudrate != listener.speed:
                    device.baudrate = listener.speed
                try:
                    async with asyncio.timeout_at(listener.ends):
                        await readable.wait()
                except TimeoutError:
                    pass
                else:
                    readable.clear()
                    with suppress(BlockingIOError):
                        listener.receive(_read(device))
                listener.tick(self._loop.time())
        finally:
            self._loop.remove_reader(device.fileno())
        return listener.what

    def _pass_over(self, port: SerialPort, why: str) -> None:
        if self._passed.get(port.path) != why:
            self._passed[port.path] = why
            _log.info("fc.port_passed_over", port=port.path, device=port.description, why=why)

    def _wait(self, seconds: float) -> None:
        self._stop_waiting()
        self._timer = self._loop.call_later(seconds, self._waited)

    def _waited(self) -> None:
        if self._present is None:
            return
        others = [port for port in serial_ports(self._host) if port.key not in self._memory.others]
        if [port.key for port in others] == [self._present.key]:
            self._wait(_SEARCH_S)
            return
        self._pass_over(self._present, "no flight controller answers")
        self.move_on()

    def _stop_waiting(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _leave(self) -> None:
        self._stop_waiting()
        self._present = None


def _read(device: serial.Serial) -> bytes:
    data = os.read(device.fileno(), _READ_SIZE)
    if not data:
        raise OSError("it was unplugged")
    return data
