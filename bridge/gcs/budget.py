# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits on the work that ground stations cause. Sans-IO: the time is passed in.

A station that has proven its rights has a budget of its own, and so have the first 16 other hosts, each for all of its
stations. All hosts that come later share one total in equal parts. A seat among the 16 may be lost in the first
seconds, to a host that stays connected, as forged addresses do not.
"""

from collections import OrderedDict
from collections.abc import Hashable
from math import inf

from bridge.gcs.cost import FLASH_PROVEN, FLASH_RESERVE, SEATS, Cost, Rate

#: Hosts that are remembered after their stations have left: a new connection does not renew a budget.
_MAX_HOSTS = 1024


class TokenBucket:
    """Counts uses: `rate.burst` at once, of which `rate.per_s` are regained in a second. The rate may change."""

    def __init__(self, rate: Rate) -> None:
        self.rate = rate
        #: The uses not yet regained at the last call of `has`.
        self.used = 0.0
        self._counted_at = 0.0

    def has(self, now: float) -> bool:
        self.used = max(0.0, self.used - max(0.0, now - self._counted_at) * self.rate.per_s)
        self._counted_at = now
        return self.used + 1.0 <= self.rate.burst

    def spend(self, amount: float = 1.0) -> None:
        """Count one; a negative amount takes it back."""
        self.used += amount

    def take(self, now: float) -> bool:
        if not self.has(now):
            return False
        self.used += 1.0
        return True


class _Buckets(dict[Cost, TokenBucket]):
    """One for each cost, made when it is first needed."""

    def __missing__(self, cost: Cost) -> TokenBucket:
        bucket = self[cost] = TokenBucket(cost.each)
        return bucket


class Budget:
    """The limits of one ground station."""

    def __init__(self) -> None:
        self._buckets = _Buckets()

    def allows(self, cost: Cost, now: float) -> bool:
        return self._buckets[cost].take(now)


class HostBudget(Budget):
    """A host, and the budget of its stations that have proven nothing."""

    def __init__(self, hosts: "HostBudgets") -> None:
        super().__init__()
        self._hosts = hosts
        #: The number of its connected stations that have proven nothing.
        self.stations = 0
        self.is_steady = False
        #: The reserve of writes to the flash that belongs to its seat; None: without one, it has a part of the total.
        self.seat: TokenBucket | None = None
        #: The writes of its stations that have proven their rights.
        self.proven_writes = TokenBucket(FLASH_PROVEN)
        self.wrote_at = -inf

    def allows(self, cost: Cost, now: float) -> bool:
        bucket = self._buckets[cost]
        if self.seat is not None:
            return bucket.take(now)
        parts, total = max(self._hosts.without_seat, 1), self._hosts.totals[cost]
        bucket.rate = Rate(
            min(cost.total.per_s / parts, cost.each.per_s), min(max(cost.total.burst / parts, 1.0), cost.each.burst)
        )
        if not (bucket.has(now) and total.take(now)):
            return False
        bucket.spend()
        return True

    def sits(self, seat: TokenBucket) -> None:
        self.seat = seat
        for cost, bucket in self._buckets.items():
            bucket.rate = cost.each

    def join(self, *, may_sit: bool) -> None:
        """A station without proven rights has connected. The host takes a seat if one is free."""
        self.stations += 1
        self._hosts.without_seat += self.stations == 1
        if may_sit and self.seat is None and self._hosts.free_seats:
            self._hosts.give_seat(self)

    def stays(self) -> None:
        """One of its stations has been connected for a while: it may take the seat of a host that has just come."""
        self.is_steady = True
        if self.seat is None:
            self._hosts.give_seat(self)

    def leave(self) -> None:
        """A station without proven rights has left, or has proven them."""
        self.stations -= 1
        if not self.stations:
            self._hosts.take_seat(self)
            self._hosts.without_seat -= 1
            self.is_steady = False


class HostBudgets:
    """The budgets of all hosts, and their seats."""

    def __init__(self) -> None:
        #: A seat's writes outlive its host: a new address gains nothing.
        self.free_seats = [TokenBucket(FLASH_RESERVE) for _ in range(SEATS)]
        #: The number of connected hosts that share the totals.
        self.without_seat = 0
        self.totals = {cost: TokenBucket(cost.total) for cost in Cost}
        self._seated: list[HostBudget] = []
        self._hosts: OrderedDict[Hashable, HostBudget] = OrderedDict()  # the one asked for least recently first

    def host(self, name: Hashable) -> HostBudget:
        """The host of this name. Too many are forgotten, except those with connected stations."""
        host = self._hosts.pop(name, None)
        if host is None:
            host = HostBudget(self)
            if len(self._hosts) >= _MAX_HOSTS:
                oldest = next((name for name, host in self._hosts.items() if not host.stations), None)
                self._hosts.pop(oldest, None)
        self._hosts[name] = host
        return host

    def give_seat(self, host: HostBudget) -> None:
        """Give a seat to a host that has none: a free one, or that of the latest host that is not steady."""
        latest = next((other for other in reversed(self._seated) if not other.is_steady), None)
        if not self.free_seats and latest is not None:
            self.take_seat(latest)
        if self.free_seats:
            seat = min(self.free_seats, key=lambda seat: seat.used)
            self.free_seats.remove(seat)
            host.sits(seat)
            self._seated.append(host)
            self.without_seat -= 1

    def take_seat(self, host: HostBudget) -> None:
        """Free the seat of a host, if it has one."""
        if host.seat is not None:
            self.free_seats.append(host.seat)
            self._seated.remove(host)
            self.without_seat += 1
            host.seat = None
