"""How the bridge says what happens; the service decides where it goes."""

from typing import Literal, Protocol

Level = Literal["debug", "info", "warning", "error"]


class Journal(Protocol):
    """Takes one event: a name, and its facts by key (units in the key's name)."""

    def __call__(self, level: Level, event: str, /, **facts: object) -> None:
        """Note the event."""
