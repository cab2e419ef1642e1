# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers in the state directory what each serial port is connected to: the flight controller or another device."""

import asyncio
import json
from contextlib import suppress
from pathlib import Path

import structlog

from storage.atomic_file import replace_file

PORTS_FILE = "ports.json"
_MAX_SIZE = 1 << 16

_log = structlog.get_logger()


class PortMemory:
    """Ports by their key (see SerialPort). Without a `folder` they are remembered until the program ends."""

    def __init__(self, folder: Path | None) -> None:
        self._file = None if folder is None else folder / PORTS_FILE
        #: The last port of the flight controller; empty at first.
        self.flight_controller = ""
        #: Ports to skip, and the device found on each.
        self.others: dict[str, str] = {}
        self._saving: set[asyncio.Task[None]] = set()
        self._load()

    def found_flight_controller(self, key: str) -> None:
        """Remember the flight controller's port."""
        if key != self.flight_controller:
            self.flight_controller = key
            self.others.pop(key, None)
            self._save()

    def found_other(self, key: str, what: str) -> None:
        """Remember a port with another device."""
        if self.others.get(key) != what:
            self.others[key] = what
            if self.flight_controller == key:
                self.flight_controller = ""
            self._save()

    def _load(self) -> None:
        if self._file is None:
            return
        try:
            kept = json.loads(self._file.read_bytes()[:_MAX_SIZE])
            self.flight_controller = str(kept["flight_controller"])
            self.others = {str(key): str(what) for key, what in kept["others"].items()}
        except FileNotFoundError:
            pass
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            _log.debug("fc.ports_forgotten", file=str(self._file), why=str(error))

    def _save(self) -> None:
        if self._file is None:
            return
        data = json.dumps({"flight_controller": self.flight_controller, "others": self.others}, indent=1).encode()
        # Not on the loop: an SD card may take a second.
        task = asyncio.get_running_loop().create_task(asyncio.to_thread(_write, self._file, data))
        self._saving.add(task)
        task.add_done_callback(self._saving.discard)


def _write(file: Path, data: bytes) -> None:
    # Without the file the ports are searched again after the next start.
    with suppress(OSError):
        replace_file(file, data)
