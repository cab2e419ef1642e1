# SPDX-License-Identifier: GPL-3.0-or-later
"""`fc = "auto"`: opens serial ports in turn until a flight controller is found.

The flight controller's last port is tried first. A port that another program uses is not opened.
"""

import asyncio
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import serial
import structlog

from bridge.model.events import BridgeEvent, FcFound, FcInCommandLine, FcLost
from service.links.fc_device import PortError, open_serial
from service.links.port_holder import find_user
from service.links.serial_ports import SerialPort, serial_ports
from service.machine.host import Host
from service.machine.state_file import StateFile

PORTS_FILE = "ports.json"
#: The search visits all speeds within this time.
_SEARCH_S = 9.0
#: How long to wait for a lost flight controller: a Harakiri that looks for the GPS boots for 25 s.
_RETURN_S = 40.0
_RETRY_S = 1.0

_log = structlog.get_logger()


class PortMemory:
    """The flight controller's last port by its key (see SerialPort), or empty at first.

    Without a `folder` it is remembered until the program ends.
    """

    def __init__(self, folder: Path | None) -> None:
        self._file = StateFile(folder, PORTS_FILE, "every port is searched again")
        self.close = self._file.close
        self.flight_controller = self._file.load(lambda kept: str(kept["flight_controller"])) or ""

    def found_flight_controller(self, key: str) -> None:
        if key != self.flight_controller:
            self.flight_controller = key
            self._file.save({"flight_controller": key})


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
                device = self._try(port)
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
        if len(ports) != 1:
            which = f"one of {', '.join(port.path for port in ports)}" if ports else "none was found"
            raise PortError(f"it is not known which port the flight controller is on ({which}): set it (fc)")
        return ports[0].path

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

    def _try(self, port: SerialPort) -> serial.Serial:
        """Open a port that may have a flight controller. PortError says why it is skipped."""
        if (user := find_user(self._host, port.path)) is not None:
            raise PortError(f"{user} uses it")
        return open_serial(str(self._host.path(port.path)))

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
        if [port.key for port in serial_ports(self._host)] == [self._present.key]:
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
