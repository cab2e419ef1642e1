# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers in the state directory what each serial port is connected to: the flight controller or another device."""

from pathlib import Path
from typing import Any

from service.machine.state_file import StateFile

PORTS_FILE = "ports.json"


class PortMemory:
    """Ports by their key (see SerialPort). Without a `folder` they are remembered until the program ends."""

    def __init__(self, folder: Path | None) -> None:
        self._file = StateFile(folder, PORTS_FILE, "every port is searched again")
        self.close = self._file.close
        #: The last port of the flight controller; empty at first.
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
