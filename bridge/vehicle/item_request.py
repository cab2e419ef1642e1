# SPDX-License-Identifier: GPL-3.0-or-later
"""How long an item of an upload is waited for before it is asked for again. Sans-IO."""

from dataclasses import dataclass

_FIRST_PATIENCE_S = 0.25
_MAX_PATIENCE_S = 1.5
#: What comes twice within so short a time was doubled by the network. Answering each copy would double every message
#: that follows, and MAVSDK gives up after five repeats; a ground station that missed our request repeats itself later.
_REPEAT_AFTER_S = 0.1


@dataclass(slots=True)
class ItemRequest:
    """The request that is out. Its patience follows the round trip of this ground station."""

    due: float = 0.0
    #: The item was asked for more than once: its answer measures nothing.
    is_repeated: bool = False
    _seq: int | None = None
    _asked_at: float = 0.0
    _patience_s: float = _FIRST_PATIENCE_S
    _round_trip_s: float | None = None

    def asked(self, seq: int, now: float) -> None:
        """The item is asked for now."""
        self.is_repeated = seq == self._seq
        self._seq = seq
        self._asked_at = now
        self.due = now + self._patience_s

    def lost(self) -> None:
        """Nothing came in time."""
        self._patience_s = min(self._patience_s * 2, _MAX_PATIENCE_S)

    def is_copy(self, now: float) -> bool:
        """Tell whether what comes again now was doubled on its way, and needs no answer of its own."""
        return now < self._asked_at + _REPEAT_AFTER_S

    def answered(self, now: float) -> None:
        """Learn from the item that was asked for.

        An answer to a repeated request measures nothing. But if it came no sooner after the repeat than answers take,
        something was lost, and patience shrinks again: MAVSDK gives up if we wait longer after each loss.
        """
        elapsed_s = now - self._asked_at
        known_s = self._round_trip_s
        if not self.is_repeated:
            old = elapsed_s if known_s is None else known_s
            self._round_trip_s = old * 7 / 8 + elapsed_s / 8
            self._patience_s = min(max(2 * self._round_trip_s, _FIRST_PATIENCE_S), _MAX_PATIENCE_S)
        elif known_s is not None and elapsed_s >= known_s / 2:
            self._patience_s = max(self._patience_s / 2, 2 * known_s, _FIRST_PATIENCE_S)
