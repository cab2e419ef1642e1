# SPDX-License-Identifier: GPL-3.0-or-later
"""The telemetry logs, for download. They reveal where the aircraft flew, so both the list and the files need the token.

A connection lasts only seconds (service.web.connection_limit), so a browser fetches a log piece by piece.
"""

import os
from functools import partial
from pathlib import Path

from payloads.mission_data import Json
from service.machine.threads import BackgroundThread
from service.recording.tlog_folder import is_log_name
from storage.small_files import open_regular

#: Bytes; 8 kB/s are enough within the time that the page waits.
PIECE = 64 << 10
_LISTED = 200
#: The page itself waits for 8 s.
_TIMEOUT_S = 5.0


class TelemetryLogs:
    """The logs in `folder`; None: no logs are written. Every method may raise OSError, even for a hanging disk."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        #: A hanging disk must not hold up the daemon's stop, as asyncio's own threads would.
        self._disk = BackgroundThread("logs", _TIMEOUT_S)

    def close(self) -> None:
        self._disk.close(0)

    async def list(self) -> Json:
        """Names and sizes in bytes, newest first."""
        return await self._disk.ask(self._list)

    async def read(self, name: str, start: int) -> bytes:
        """At most PIECE bytes from `start`. FileNotFoundError if there is no such log."""
        return await self._disk.ask(partial(self._read, name, start))

    def _list(self) -> Json:
        if self._folder is None or not self._folder.exists():
            return {"logs": []}
        found = [entry for entry in os.scandir(self._folder) if is_log_name(entry.name) and entry.is_file()]
        found.sort(key=lambda entry: entry.name, reverse=True)
        return {"logs": [{"name": entry.name, "size": entry.stat().st_size} for entry in found[:_LISTED]]}

    def _read(self, name: str, start: int) -> bytes:
        if self._folder is None or not is_log_name(name) or not (self._folder / name).exists():
            raise FileNotFoundError("there is no such log; log/list names them")
        with open_regular(self._folder / name) as file:
            file.seek(start)
            return file.read(PIECE)
