# SPDX-License-Identifier: GPL-3.0-or-later
"""Message rates of each ground station: as requested, else the defaults. Sans-IO."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import inf

from bridge.gcs.budget import TokenBucket
from bridge.gcs.cost import Rate
from bridge.gcs.station import Peer

#: Messages a second to all ground stations together. The defaults are 55 a second. Peers with standing share one half,
#: at least 75 a second for each of the 16 on a link; all others share the other half.
_MOST_PER_S = 2400
#: A message due within this fraction of its interval is sent now, because the readings arrive at their own rate.
_EARLY = 0.25
#: The shortest interval for an unwatched peer, s. The default rates would cost a Pi Zero twice the CPU.
_UNWATCHED_S = 0.1


class MessageRates:
    """Intervals in seconds; infinity: never. `defaults` holds every known message id."""

    def __init__(self, defaults: Mapping[int, float]) -> None:
        self._defaults = defaults
        self._requested: dict[Peer, dict[int, float]] = {}
        self._due: dict[tuple[Peer, int], float] = {}
        self._shares: dict[Peer, TokenBucket] = {}
        self._newcomers_share = Rate(_MOST_PER_S, _MOST_PER_S)
        #: Peers at whose end there may be no station. They get no message more than ten times a second.
        self.unwatched: Collection[Peer] = ()

    def request(self, peer: Peer, msgid: int, interval_s: float | None) -> None:
        """Set the interval that a ground station requests; None: the default."""
        self._due.pop((peer, msgid), None)
        if interval_s is None:
            self._requested.get(peer, {}).pop(msgid, None)
        else:
            self._requested.setdefault(peer, {})[msgid] = interval_s

    def interval_s(self, peer: Peer, msgid: int) -> float:
        """The interval requested by a ground station, or the default."""
        requested = self._requested.get(peer)
        interval_s = self._defaults[msgid] if requested is None else requested.get(msgid, self._defaults[msgid])
        return max(interval_s, _UNWATCHED_S) if peer in self.unwatched else interval_s

    def fastest_s(self, msgid: int, peers: Iterable[Peer]) -> float:
        """The shortest interval of `peers`."""
        return min((self.interval_s(peer, msgid) for peer in peers), default=inf)

    def take_due(self, msgid: int, peers: Sequence[Peer], now: float) -> list[Peer]:
        """The peers for which the message is due now; schedules the next one for each."""
        taken = []
        for peer in peers:
            interval_s = self.interval_s(peer, msgid)
            due = self._due.get((peer, msgid), -inf)
            if interval_s == inf or now < due - interval_s * _EARLY:
                continue
            bucket = self._shares.get(peer)
            if bucket is None:
                bucket = self._shares[peer] = TokenBucket(self._newcomers_share)
            if not bucket.has(now):
                continue
            bucket.spend()
            # Counted from the due time to keep the rate, but missed messages are not caught up.
            self._due[peer, msgid] = (due if now < due + interval_s else now) + interval_s
            taken.append(peer)
        return taken

    def keep(self, peers: Iterable[Peer], with_standing: Collection[Peer]) -> None:
        """Forget all other peers. `with_standing`: those whose share does not depend on the number of the others."""
        present = set(peers)
        for peer in (self._requested.keys() | self._shares) - present:
            self._requested.pop(peer, None)
            self._shares.pop(peer, None)
        for key in [key for key in self._due if key[0] not in present]:
            del self._due[key]
        share, self._newcomers_share = _share(len(with_standing)), _share(len(present) - len(with_standing))
        for peer, bucket in self._shares.items():
            bucket.rate = share if peer in with_standing else self._newcomers_share


def _share(peers: int) -> Rate:
    """Each peer's share of half the total rate."""
    return Rate(_MOST_PER_S / 2 / max(peers, 1), _MOST_PER_S / 2 / max(peers, 1))
