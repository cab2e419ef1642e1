# SPDX-License-Identifier: GPL-3.0-or-later
"""How the bridge says what happens; the service decides where it goes."""

from typing import Literal, Protocol

Level = Literal["debug", "info", "warning", "error"]


class EventLog(Protocol):
    """Takes one event: a name, and its facts by key (units in the key's name)."""

    def __call__(self, level: Level, event: str, /, **facts: object) -> None:
        """Note the event."""


class Incidents:
    """Numbers what is followed through the log: a link lost and found, an upload, a push.

    All lines of one incident carry its id as the fact `incident`. Ids are unique within one run of the daemon.
    """

    def __init__(self) -> None:
        self._count = 0

    def begin(self, kind: str) -> str:
        """Return an id, as "upload-7"."""
        self._count += 1
        return f"{kind}-{self._count}"
