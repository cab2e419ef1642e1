# SPDX-License-Identifier: GPL-3.0-or-later
"""Rate limits for each ground station and for all of them together. Sans-IO: the time is passed in."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from math import exp

from bridge.gcs.cost import LIMITS, Cost, Rate
from bridge.gcs.station import Peer

#: The number of accounts for hosts: forged ones cannot use more memory.
_ACCOUNTS = 1024
#: Counts grow by this factor before they are scaled back, which forgets those below 1 / 1000.
_RESCALE_AT = 1e6
#: After this many times the memory's length every count has decayed to 0; the clock may also start at any value.
_ALL_FORGOTTEN = 50.0


class TokenBucket:
    """A token bucket, full at the start."""

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


class Shares:
    """A budget for many accounts; uses decay exponentially.

    `rate.burst` uses at once; of these, at most `rate.per_s` are regained in a second.
    """

    def __init__(self, rate: Rate) -> None:
        self._burst = rate.burst
        self._memory_s = rate.burst / rate.per_s
        # Instead of shrinking all counts over time, the unit of counting grows.
        self._unit = 1.0
        self._unit_at = 0.0
        self._used: dict[Hashable, float] = {}
        self._total = 0.0

    def left(self, now: float) -> float:
        """The uses left; below 0 if more were spent."""
        self._unit *= exp(min(max(0.0, now - self._unit_at) / self._memory_s, _ALL_FORGOTTEN))
        self._unit_at = now
        if self._unit >= _RESCALE_AT:
            kept = {account: used / self._unit for account, used in self._used.items()}
            self._used = {account: used for account, used in kept.items() if used >= 1e-3}
            self._total = sum(self._used.values())
            self._unit = 1.0
        return self._burst - self._total / self._unit

    def used(self, account: Hashable) -> float:
        """The account's recent uses, as of the last call of `left`."""
        return self._used.get(account, 0.0) / self._unit

    def spend(self, account: Hashable, amount: float = 1.0) -> None:
        """Count a use; a negative amount takes it back."""
        self._used[account] = self._used.get(account, 0.0) + amount * self._unit
        self._total += amount * self._unit

    def hand_over(self, account: Hashable, heir: Hashable) -> None:
        """Continue an account under another name."""
        self._used[heir] = self._used.pop(account, 0.0)


class Budgets:
    """Counts the work that each peer causes.

    `has_standing`: True for a peer that has authenticated, or has precedence on its link (bridge.gcs.stations). It has
    its own budgets. The others share theirs by host: a stranger gains nothing from many ports. All of them share a
    total, of which a host may use as much as it leaves: each of n busy hosts uses 1 / (n + 1), and a newcomer finds as
    much.
    """

    def __init__(self, has_standing: Callable[[Peer], bool]) -> None:
        self._has_standing = has_standing
        #: By cost and peer, or the account of its host.
        self._buckets: dict[tuple[Cost, Peer | int], TokenBucket] = {}
        #: The account of each host, the host heard least recently first.
        self._accounts: OrderedDict[Hashable, int] = OrderedDict()
        self._totals = {cost: Shares(limit.total) for cost, limit in LIMITS.items()}
        #: How often each limit was exceeded.
        self.exceeded = dict.fromkeys(Cost, 0)

    def allows(self, cost: Cost, peer: Peer, now: float) -> bool:
        """Count one for a peer; False if that exceeds a limit."""
        account = None if self._has_standing(peer) else self._account(peer.host)
        key = cost, peer if account is None else account
        bucket = self._buckets.get(key)
        if bucket is None:
            bucket = self._buckets[key] = TokenBucket(LIMITS[cost].each)
        total = self._totals[cost]
        if not (bucket.has(now) and (account is None or total.left(now) > total.used(account))):
            self.exceeded[cost] += 1
            return False
        bucket.spend()
        if account is not None:
            total.spend(account)
        return True

    def _account(self, host: Hashable) -> int:
        """The host's account. If all are taken, a new host continues that of the host heard least recently."""
        account = self._accounts.pop(host, None)
        if account is None:
            is_room = len(self._accounts) < _ACCOUNTS
            account = len(self._accounts) if is_room else self._accounts.popitem(last=False)[1]
        self._accounts[host] = account
        return account

    def forget(self, peer: Peer) -> None:
        for cost in Cost:
            self._buckets.pop((cost, peer), None)
