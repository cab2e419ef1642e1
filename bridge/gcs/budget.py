# SPDX-License-Identifier: GPL-3.0-or-later
"""Rate limits for each ground station and for all of them together. Sans-IO: the time is passed in."""

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar
from zlib import crc32

from bridge.gcs.cost import LIMITS, Cost, Rate
from bridge.gcs.station import Peer

K = TypeVar("K", bound=Hashable)

#: Hosts whose addresses have the same checksum share a budget.
_HOST_GROUPS = 1024


class TokenBucket:
    """A token bucket for `rate`; the count restarts whenever the bucket is full."""

    def __init__(self, rate: Rate) -> None:
        self.rate = rate
        self._tokens = rate.burst
        self._counted_at = 0.0

    def has(self, now: float) -> bool:
        """True if one more is allowed now."""
        self._tokens = min(self.rate.burst, self._tokens + max(0.0, now - self._counted_at) * self.rate.per_s)
        self._counted_at = now
        return self._tokens >= 1.0

    def spend(self) -> None:
        """Count one."""
        self._tokens -= 1.0


class Budgets:
    """Counts the work that each peer causes.

    `has_standing`: True for a peer that has authenticated, or has precedence on its link (bridge.gcs.stations). It has
    budgets of its own. The others share theirs by host, and in all: a stranger gains nothing from many ports, and can
    use up only the share of other newcomers.
    """

    def __init__(self, has_standing: Callable[[Peer], bool]) -> None:
        self._has_standing = has_standing
        self._peers: dict[tuple[Cost, Peer], TokenBucket] = {}
        self._hosts: dict[tuple[Cost, int], TokenBucket] = {}
        self._totals = {cost: TokenBucket(limit.total) for cost, limit in LIMITS.items()}
        #: How often each limit was exceeded.
        self.exceeded = dict.fromkeys(Cost, 0)

    def allows(self, cost: Cost, peer: Peer, now: float) -> bool:
        """Count one for a peer; False if that exceeds a limit."""
        buckets = self._buckets(cost, peer)
        for bucket in buckets:
            if not bucket.has(now):
                self.exceeded[cost] += 1
                return False
        for bucket in buckets:
            bucket.spend()
        return True

    def keep(self, peers: Iterable[Peer]) -> None:
        """Forget peers that are gone."""
        present = set(peers)
        for key in [key for key in self._peers if key[1] not in present]:
            del self._peers[key]

    def _buckets(self, cost: Cost, peer: Peer) -> Sequence[TokenBucket]:
        if self._has_standing(peer):
            return (_bucket(self._peers, (cost, peer), cost),)
        # Made-up hosts need no more memory than this.
        group = crc32(str(peer.host).encode()) % _HOST_GROUPS
        return _bucket(self._hosts, (cost, group), cost), self._totals[cost]


def _bucket(buckets: dict[K, TokenBucket], key: K, cost: Cost) -> TokenBucket:
    bucket = buckets.get(key)
    if bucket is None:
        bucket = buckets[key] = TokenBucket(LIMITS[cost].each)
    return bucket
