# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's log events; the service decides where they go."""

from typing import Literal, Protocol

Level = Literal["debug", "info", "warning", "error"]


class EventLog(Protocol):
    """Logs one event: its name, and its facts by key (with the unit in the key).

    Related lines, of a link lost and found, an upload or a push, carry the same id as the fact `incident`.
    """

    def __call__(self, level: Level, event: str, /, **facts: object) -> None:
        """Log the event."""
