# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups refusals by attempt: Mission Planner repeats a request up to seven times, and one text is enough."""

from collections.abc import Iterable

from bridge.gcs.station import Peer

#: A client repeats a request within 0.7 s; a pilot who tries again takes longer, and gets the reason again.
_QUIET_S = 1.0
#: The limit only means that at worst a text is repeated.
_MAX_TEXTS = 256


class RecentTexts:
    """Remembers each text until 1 s has passed without a repetition."""

    def __init__(self) -> None:
        self._told: dict[tuple[Peer, str], float] = {}  # oldest first

    def new_to(self, peers: Iterable[Peer], text: str, now: float) -> list[Peer]:
        """Those of `peers` for whom `text` is new in this attempt."""
        while self._told:
            oldest = next(iter(self._told))
            if now < self._told[oldest] + _QUIET_S and len(self._told) <= _MAX_TEXTS:
                break
            del self._told[oldest]
        new = []
        for peer in peers:
            if self._told.pop((peer, text), None) is None:
                new.append(peer)
            self._told[peer, text] = now
        return new
