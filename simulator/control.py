# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines from a test in another process: switch faults, pull plugs, read the counters.

    FAULT VALUE         a field of the board's faults and a number (switches: 0 or 1)
    power on|off
    plug, unplug
    stats               one line of JSON: counters, state, and the stored records in hex
    truth               one line of JSON: what the craft is doing at this moment (simulator.flight)

The answer is `ok`, the JSON, or `error: ...`.
"""

import asyncio
import json
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Protocol

from simulator.emulated_naze.switches import EmulatedCounters, EmulatedFaults
from simulator.far_end import FarEnd
from simulator.flight import Craft
from simulator.options import Counters, Faults
from simulator.pty_link import PlugError


class ControlledBoard(FarEnd, Protocol):
    """A simulated board with switches and counters."""

    @property
    def faults(self) -> Faults | EmulatedFaults:
        """The switches."""

    @property
    def counters(self) -> Counters | EmulatedCounters:
        """What has happened so far."""

    @property
    def armed(self) -> bool:
        """Return whether the craft is armed."""

    @property
    def power(self) -> Enum:
        """Return what the CPU is doing."""

    @property
    def protocol(self) -> Enum | None:
        """Return what the firmware believes to be spoken; None if it speaks one only, or does not run."""

    @property
    def stored_records(self) -> list[bytes]:
        """Return the mission that outlives a power cut."""

    def truth(self, now: float) -> Craft | None:
        """Return what the craft is doing; None while no firmware runs, and from a board that only lies on a bench."""

    def power_on(self, now: float) -> None:
        """Supply it."""

    def power_off(self, now: float) -> None:
        """Cut the supply."""


class Plug(Protocol):
    """Where a client finds the board."""

    def plug(self) -> None:
        """Make the place. PlugError if it is not to be had."""

    def unplug(self) -> None:
        """Take it away."""

    def poke(self) -> None:
        """Make a fault that was just switched count at once."""


class Control:
    """Obeys control lines."""

    def __init__(self, board: ControlledBoard, link: Plug, loop: asyncio.AbstractEventLoop) -> None:
        self._board = board
        self._link = link
        self._loop = loop
        self._server: asyncio.Server | None = None

    async def listen(self, path: Path) -> None:
        """Listen on a Unix socket. OSError if it cannot be made."""
        self._server = await asyncio.start_unix_server(self._converse, path)
        self._path = path

    def close(self) -> None:
        """Stop listening and take the socket away."""
        if self._server:
            self._server.close()
            self._path.unlink(missing_ok=True)

    def obey(self, line: str) -> str:
        """Carry a line out and return the answer."""
        now = self._loop.time()
        match line.split():
            case ["stats"]:
                return json.dumps(self._stats())
            case ["truth"]:
                craft = self._board.truth(now)
                return json.dumps(None if craft is None else asdict(craft))
            case ["power", "on"]:
                self._board.power_on(now)
            case ["power", "off"]:
                self._board.power_off(now)
            case ["plug"]:
                try:
                    self._link.plug()
                except PlugError as error:
                    return f"error: {error}"
            case ["unplug"]:
                self._link.unplug()
            case [name, value] if name in asdict(self._board.faults):
                faults = self._board.faults
                try:
                    setattr(faults, name, type(getattr(faults, name))(float(value)))
                except ValueError:
                    return f"error: {name} takes a number, not {value!r}"
            case _:
                return f"error: unknown line {line.strip()!r}"
        self._link.poke()
        return "ok"

    def _stats(self) -> dict[str, object]:
        board = self._board
        return asdict(board.counters) | {
            "armed": board.armed,
            "baud": board.baud,
            "power": board.power.name,
            "protocol": board.protocol.name if board.protocol else None,
            "records": [record.hex() for record in board.stored_records],
        }

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while line := await reader.readline():
            writer.write(f"{self.obey(line.decode(errors='replace'))}\n".encode())
        writer.close()
