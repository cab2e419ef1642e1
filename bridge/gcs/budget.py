# SPDX-License-Identifier: GPL-3.0-or-later
"""Rate limits for each ground station and for all of them together. Sans-IO: the time is passed in."""

from collections.abc import Callable, Iterable

from bridge.gcs.cost import LIMITS, Cost, Rate
from bridge.gcs.station import Peer


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

    `has_standing`: True for a peer that has authenticated, or that connected before a link filled up. Only its own
    limit applies to it, so strangers cannot use up the pilot's share.
    """

    def __init__(self, has_standing: Callable[[Peer], bool]) -> None:
        self._has_standing = has_standing
        self._peers: dict[tuple[Cost, Peer], TokenBucket] = {}
        self._totals = {cost: TokenBucket(limit.total) for cost, limit in LIMITS.items()}
        #: How often each limit was exceeded.
        self.exceeded = dict.fromkeys(Cost, 0)

    def allows(self, cost: Cost, peer: Peer, now: float) -> bool:
        """Count one for a peer; False if that exceeds a limit."""
        own = self._peers.get((cost, peer))
        if own is None:
            own = self._peers[cost, peer] = TokenBucket(LIMITS[cost].each)
        total = None if self._has_standing(peer) else self._totals[cost]
        if not own.has(now) or not (total is None or total.has(now)):
            self.exceeded[cost] += 1
            return False
        own.spend()
        if total is not None:
            total.spend()
        return True

    def keep(self, peers: Iterable[Peer]) -> None:
        """Forget peers that are gone."""
        present = set(peers)
        for key in [key for key in self._peers if key[1] not in present]:
            del self._peers[key]
