# SPDX-License-Identifier: GPL-3.0-or-later
"""How often each ground station gets which message: its own wishes, else the defaults. Sans-IO."""

from collections.abc import Iterable, Mapping, Sequence
from math import inf

from bridge.gcs.budget import TokenBucket
from bridge.gcs.cost import Rate
from bridge.gcs.station import Peer

#: Messages a second to all ground stations together; each has an equal share. The defaults are 55 a second.
_MOST_PER_S = 2400
#: A message that is due within this part of its interval goes out now: what carries it comes at a pace of its own.
_EARLY = 0.25


class MessageRates:
    """Intervals in seconds; infinity: never. `defaults` names the messages that there are, by their ids."""

    def __init__(self, defaults: Mapping[int, float]) -> None:
        self._defaults = defaults
        self._wishes: dict[Peer, dict[int, float]] = {}
        self._due: dict[tuple[Peer, int], float] = {}
        self._shares: dict[Peer, TokenBucket] = {}

    def knows(self, msgid: int) -> bool:
        """Tell whether there is such a message."""
        return msgid in self._defaults

    def wish(self, peer: Peer, msgid: int, interval_s: float | None) -> None:
        """Note what a ground station wants; None: the default."""
        self._due.pop((peer, msgid), None)
        if interval_s is None:
            self._wishes.get(peer, {}).pop(msgid, None)
        else:
            self._wishes.setdefault(peer, {})[msgid] = interval_s

    def interval_s(self, peer: Peer, msgid: int) -> float:
        """Return what a ground station wants, or the default."""
        wishes = self._wishes.get(peer)
        return self._defaults[msgid] if wishes is None else wishes.get(msgid, self._defaults[msgid])

    def fastest_s(self, msgid: int, peers: Iterable[Peer]) -> float:
        """Return the shortest interval that any of `peers` wants."""
        return min((self.interval_s(peer, msgid) for peer in peers), default=inf)

    def take_due(self, msgid: int, peers: Sequence[Peer], now: float) -> list[Peer]:
        """Those of `peers` to whom the message is to be sent now; the next time counts from here."""
        taken = []
        share = Rate(_MOST_PER_S / max(1, len(peers)), _MOST_PER_S / max(1, len(peers)))
        for peer in peers:
            interval_s = self.interval_s(peer, msgid)
            due = self._due.get((peer, msgid), -inf)
            if interval_s == inf or now < due - interval_s * _EARLY:
                continue
            bucket = self._shares.get(peer)
            if bucket is None:
                bucket = self._shares[peer] = TokenBucket(share)
            bucket.rate = share
            if not bucket.has(now):
                continue
            bucket.spend()
            # On from when it was due, so that the rate is kept; but what was missed is not made up for.
            self._due[peer, msgid] = (due if now < due + interval_s else now) + interval_s
            taken.append(peer)
        return taken

    def keep(self, peers: Iterable[Peer]) -> None:
        """Forget who is none of `peers`."""
        present = set(peers)
        for peer in [peer for peer in self._wishes if peer not in present]:
            del self._wishes[peer]
        for peer in [peer for peer in self._shares if peer not in present]:
            del self._shares[peer]
        for key in [key for key in self._due if key[0] not in present]:
            del self._due[key]
