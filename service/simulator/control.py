"""Lines from a test in another process: switch faults, pull plugs, read the counters.

    FAULT VALUE         a field of Faults and a number (switches: 0 or 1)
    power on|off
    plug, unplug
    stats               one line of JSON: counters, state, and the stored records in hex
    truth               one line of JSON: what the craft is doing at this moment (service.simulator.flight)

The answer is `ok`, the JSON, or `error: ...`.
"""

import asyncio
import json
from dataclasses import asdict
from pathlib import Path

from protocols.wp_record import RECORD_SIZE
from service.simulator.naze import SimulatedNaze
from service.simulator.options import Faults
from service.simulator.pty_link import PlugError, PtyLink

_FAULTS = {name: type(value) for name, value in asdict(Faults()).items()}


class Control:
    """Obeys control lines."""

    def __init__(self, naze: SimulatedNaze, link: PtyLink, loop: asyncio.AbstractEventLoop) -> None:
        self._naze = naze
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
                craft = self._naze.truth(now)
                return json.dumps(None if craft is None else asdict(craft))
            case ["power", "on"]:
                self._naze.power_on(now)
            case ["power", "off"]:
                self._naze.power_off(now)
            case ["plug"]:
                try:
                    self._link.plug()
                except PlugError as error:
                    return f"error: {error}"
            case ["unplug"]:
                self._link.unplug()
            case [name, value] if name in _FAULTS:
                try:
                    setattr(self._naze.faults, name, _FAULTS[name](float(value)))
                except ValueError:
                    return f"error: {name} takes a number, not {value!r}"
            case _:
                return f"error: unknown line {line.strip()!r}"
        self._link.poke()
        return "ok"

    def _stats(self) -> dict[str, object]:
        naze, stored = self._naze, self._naze.stored
        return asdict(naze.counters) | {
            "armed": naze.armed,
            "baud": naze.baud,
            "power": naze.power.name,
            "protocol": naze.protocol.name if naze.protocol else None,
            "records": [stored[at : at + RECORD_SIZE].hex() for at in range(0, len(stored), RECORD_SIZE)],
        }

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while line := await reader.readline():
            writer.write(f"{self.obey(line.decode(errors='replace'))}\n".encode())
        writer.close()
