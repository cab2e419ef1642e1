# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits on the work that ground stations cause: one for each address, and one for all. Sans-IO: time is passed in."""

from collections import OrderedDict
from collections.abc import Hashable

from bridge.gcs.cost import Cost, Rate

#: Addresses that are remembered after their stations have left: a new connection does not renew a budget.
_MAX_HOSTS = 1024


class TokenBucket:
    """Counts uses: `rate.burst` at once, of which `rate.per_s` are regained in a second."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        #: The uses not yet regained when it was last counted.
        self._used = 0.0
        self._counted_at = 0.0

    def has(self, now: float) -> bool:
        self._used = max(0.0, self._used - max(0.0, now - self._counted_at) * self._rate.per_s)
        self._counted_at = now
        return self._used + 1.0 <= self._rate.burst

    def spend(self, amount: float = 1.0) -> None:
        """Count one; a negative amount takes it back."""
        self._used += amount

    def take(self, now: float) -> bool:
        """Count one; False if it exceeds the limit. As `has` and `spend`, which would be two calls for each frame."""
        used = max(0.0, self._used - max(0.0, now - self._counted_at) * self._rate.per_s)
        self._counted_at = now
        is_allowed = used + 1.0 <= self._rate.burst
        self._used = used + is_allowed
        return is_allowed


class Budget:
    """The limits of one address, for all of its stations."""

    def __init__(self, totals: dict[Cost, TokenBucket]) -> None:
        self._totals = totals
        self._own: dict[Cost, TokenBucket] = {}

    def allows(self, cost: Cost, now: float, *, is_proven: bool = False) -> bool:
        """Count work; False if it exceeds a limit. Work of a station with proven rights is not in the total."""
        own = self._own.get(cost)
        if own is None:
            own = self._own[cost] = TokenBucket(cost.each)
        if not own.take(now):
            return False
        if is_proven or self._totals[cost].take(now):
            return True
        own.spend(-1.0)
        return False

    def give_back(self, cost: Cost, *, is_proven: bool = False) -> None:
        """Take back work that was allowed, but not done."""
        self._own[cost].spend(-1.0)
        if not is_proven:
            self._totals[cost].spend(-1.0)


class Budgets:
    """The budgets of all addresses, and their totals."""

    def __init__(self) -> None:
        self.totals = {cost: TokenBucket(cost.total) for cost in Cost}
        self._hosts: OrderedDict[Hashable, Budget] = OrderedDict()  # the one asked for least recently first

    def of(self, host: Hashable) -> Budget:
        budget = self._hosts.pop(host, None) or Budget(self.totals)
        self._hosts[host] = budget
        if len(self._hosts) > _MAX_HOSTS:
            self._hosts.popitem(last=False)
        return budget
