# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's log events; the service decides where they go."""

from typing import Literal, Protocol

Level = Literal["debug", "info", "warning", "error"]


class EventLog(Protocol):
    """Logs one event: its name, and its facts by key (with the unit in the key)."""

    def __call__(self, level: Level, event: str, /, **facts: object) -> None:
        """Log the event."""


class Incidents:
    """Ids for related log lines: a link lost and found, an upload, a push.

    All lines of one incident carry its id as the fact `incident`. Ids are unique within one run of the daemon.
    """

    def __init__(self) -> None:
        self._count = 0

    def begin(self, kind: str) -> str:
        """A new id, such as "upload-7"."""
        self._count += 1
        return f"{kind}-{self._count}"
