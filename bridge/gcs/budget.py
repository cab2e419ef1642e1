# SPDX-License-Identifier: GPL-3.0-or-later
"""Rate limits for each ground station and for all of them together. Sans-IO: the time is passed in."""

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

from bridge.gcs.cost import LIMITS, Cost, Rate
from bridge.gcs.shares import Shares
from bridge.gcs.station import Peer

K = TypeVar("K", bound=Hashable)

#: Hosts with the same hash share a budget, so forged ones cannot use more memory than this. The hash of a text differs
#: between processes, so an attacker cannot choose an address that shares the pilot's budget.
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

    def spend(self, amount: float = 1.0) -> None:
        """Count one; a negative amount takes it back."""
        self._tokens -= amount


class Budgets:
    """Counts the work that each peer causes.

    `has_standing`: True for a peer that has authenticated, or has precedence on its link (bridge.gcs.stations). It has
    budgets of its own. The others share theirs by host: a stranger gains nothing from many ports. All of them share a
    total, of which a host may use as much as it leaves to others: of n greedy hosts each uses 1 / (n + 1), and as much
    is left for a newcomer.
    """

    def __init__(self, has_standing: Callable[[Peer], bool]) -> None:
        self._has_standing = has_standing
        self._peers: dict[tuple[Cost, Peer], TokenBucket] = {}
        self._hosts: dict[tuple[Cost, int], TokenBucket] = {}
        self._totals = {cost: Shares(limit.total) for cost, limit in LIMITS.items()}
        #: How often each limit was exceeded.
        self.exceeded = dict.fromkeys(Cost, 0)

    def allows(self, cost: Cost, peer: Peer, now: float) -> bool:
        """Count one for a peer; False if that exceeds a limit."""
        if self._has_standing(peer):
            bucket, group = _bucket(self._peers, (cost, peer), cost), None
        else:
            group = hash(str(peer.host)) % _HOST_GROUPS
            bucket = _bucket(self._hosts, (cost, group), cost)
        total = self._totals[cost]
        if not (bucket.has(now) and (group is None or total.left(now) > total.used(group))):
            self.exceeded[cost] += 1
            return False
        bucket.spend()
        if group is not None:
            total.spend(group)
        return True

    def keep(self, peers: Iterable[Peer]) -> None:
        """Forget peers that are gone."""
        present = set(peers)
        for key in [key for key in self._peers if key[1] not in present]:
            del self._peers[key]


def _bucket(buckets: dict[K, TokenBucket], key: K, cost: Cost) -> TokenBucket:
    bucket = buckets.get(key)
    if bucket is None:
        bucket = buckets[key] = TokenBucket(LIMITS[cost].each)
    return bucket
