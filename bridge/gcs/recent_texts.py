# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups refusals by attempt: Mission Planner repeats a request up to seven times, and one text is enough."""

from collections.abc import Iterable

from bridge.gcs.station import Peer

#: A client repeats a request within 0.7 s; a pilot who tries again takes longer, and gets the reason again.
_QUIET_S = 1.0
#: Beyond this limit a text may be repeated.
_MAX_TEXTS = 256


class RecentTexts:
    """Remembers each text until 1 s has passed without a repetition."""

    def __init__(self) -> None:
        self._sent: dict[tuple[Peer, str], float] = {}  # oldest first

    def new_to(self, peers: Iterable[Peer], text: str, now: float) -> list[Peer]:
        """Those of `peers` for whom `text` is new in this attempt."""
        while self._sent:
            oldest = next(iter(self._sent))
            if now < self._sent[oldest] + _QUIET_S and len(self._sent) <= _MAX_TEXTS:
                break
            del self._sent[oldest]
        new = []
        for peer in peers:
            if self._sent.pop((peer, text), None) is None:
                new.append(peer)
            self._sent[peer, text] = now
        return new
