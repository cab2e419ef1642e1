# SPDX-License-Identifier: GPL-3.0-or-later
"""Control of a simulated board by another process: set faults, pull the plug, read the counters.

    FAULT NUMBER        set a field of the board's faults (switches: 0 or 1)
    power on|off
    reset               the CPU's reset line
    plug, unplug
    stats               one line of JSON: counters, state, and the stored records in hex
    truth               one line of JSON: the craft's true state (simulator.board.flight)

The answer is `ok`, the JSON, or `error: ...`.
"""

import asyncio
import json
from dataclasses import asdict
from pathlib import Path
from typing import Protocol

from simulator.board.simulated_board import SimulatedBoard
from simulator.links.pty_link import PlugError


class Plug(Protocol):
    """The board's connection to a client."""

    def plug(self) -> None:
        """Connect. PlugError if that fails."""

    def unplug(self) -> None:
        """Disconnect."""

    def poke(self) -> None:
        """Apply a changed fault at once."""


class Control:
    """Executes control lines."""

    def __init__(self, board: SimulatedBoard, link: Plug, loop: asyncio.AbstractEventLoop) -> None:
        self._board = board
        self._link = link
        self._loop = loop
        self._server: asyncio.Server | None = None

    async def listen(self, path: Path) -> None:
        """Listen on a Unix socket. OSError if it cannot be created."""
        self._server = await asyncio.start_unix_server(self._converse, path)
        self._path = path

    def close(self) -> None:
        if self._server:
            self._server.close()
            self._path.unlink(missing_ok=True)

    def execute(self, line: str) -> str:
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
            case ["reset"]:
                self._board.reset(now)
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
                except (TypeError, ValueError, OverflowError):
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
            writer.write(f"{self.execute(line.decode(errors='replace'))}\n".encode())
        writer.close()
