# SPDX-License-Identifier: GPL-3.0-or-later
"""The timeout of item requests during an upload. Sans-IO."""

from dataclasses import dataclass

_FIRST_TIMEOUT_S = 0.25
_MAX_TIMEOUT_S = 1.5
#: A message repeated within this time was duplicated by the network. Answering each copy would double every message
#: that follows, and MAVSDK gives up after five repeats; a ground station that missed our request repeats it later.
_REPEAT_AFTER_S = 0.1


@dataclass(slots=True)
class ItemRequest:
    """The pending request. Its timeout follows the round trip time of this ground station."""

    due: float = 0.0
    #: The item was requested more than once: its answer gives no round trip time.
    is_repeated: bool = False
    _seq: int | None = None
    _asked_at: float = 0.0
    _timeout_s: float = _FIRST_TIMEOUT_S
    _round_trip_s: float | None = None

    def asked(self, seq: int, now: float) -> None:
        """A request was sent now."""
        self.is_repeated = seq == self._seq
        self._seq = seq
        self._asked_at = now
        self.due = now + self._timeout_s

    def lost(self) -> None:
        """The request timed out."""
        self._timeout_s = min(self._timeout_s * 2, _MAX_TIMEOUT_S)

    def is_copy(self, now: float) -> bool:
        """True if a repeated message was duplicated on its way, and needs no answer of its own."""
        return now < self._asked_at + _REPEAT_AFTER_S

    def answered(self, now: float) -> None:
        """Update the timeout when the requested item arrives.

        The answer to a repeated request gives no round trip time. But if it took a usual round trip after the repeat,
        a frame was lost, and the timeout shrinks again: MAVSDK gives up if we wait longer after each loss.
        """
        elapsed_s = now - self._asked_at
        known_s = self._round_trip_s
        if not self.is_repeated:
            old = elapsed_s if known_s is None else known_s
            self._round_trip_s = old * 7 / 8 + elapsed_s / 8
            self._timeout_s = min(max(2 * self._round_trip_s, _FIRST_TIMEOUT_S), _MAX_TIMEOUT_S)
        elif known_s is not None and elapsed_s >= known_s / 2:
            self._timeout_s = max(self._timeout_s / 2, 2 * known_s, _FIRST_TIMEOUT_S)
