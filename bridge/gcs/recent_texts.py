# SPDX-License-Identifier: GPL-3.0-or-later
"""What each ground station was told lately: Mission Planner asks seven times over, and one refusal is enough."""

from collections.abc import Iterable

from bridge.gcs.station import Peer

_QUIET_S = 10.0
#: More are not remembered: at worst a text is repeated.
_MAX_TEXTS = 256


class RecentTexts:
    """Remembers texts for 10 s."""

    def __init__(self) -> None:
        self._told: dict[tuple[Peer, str], float] = {}  # oldest first

    def new_to(self, peers: Iterable[Peer], text: str, now: float) -> list[Peer]:
        """Return those of `peers` who were not told `text` lately; now they were."""
        while self._told:
            oldest = next(iter(self._told))
            if now < self._told[oldest] + _QUIET_S and len(self._told) <= _MAX_TEXTS:
                break
            del self._told[oldest]
        untold = [peer for peer in peers if (peer, text) not in self._told]
        self._told.update({(peer, text): now for peer in untold})
        return untold
