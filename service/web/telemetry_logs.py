# SPDX-License-Identifier: GPL-3.0-or-later
"""The telemetry logs, for download. They reveal where the aircraft flew, so both the list and the files need the token.

A connection lasts only seconds (service.web.connection_limit), so a browser fetches a log piece by piece.
"""

import os
from pathlib import Path

from service.daemon.mission_data import Json
from service.recording.tlog_folder import is_log_name

PIECE = 256 << 10
_LISTED = 200


class TelemetryLogs:
    """The logs in `folder`; None: no logs are written."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def list(self) -> Json:
        """Names and sizes in bytes, newest first. OSError if the folder cannot be read."""
        if self._folder is None or not self._folder.exists():
            return {"logs": []}
        found = [entry for entry in os.scandir(self._folder) if is_log_name(entry.name) and entry.is_file()]
        found.sort(key=lambda entry: entry.name, reverse=True)
        return {"logs": [{"name": entry.name, "size": entry.stat().st_size} for entry in found[:_LISTED]]}

    def read(self, name: str, start: int) -> bytes:
        """At most PIECE bytes from `start`. FileNotFoundError if there is no such log."""
        if self._folder is None or not is_log_name(name):
            raise FileNotFoundError(name)
        with (self._folder / name).open("rb") as file:
            file.seek(start)
            return file.read(PIECE)
