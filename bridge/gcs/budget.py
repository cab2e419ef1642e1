# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits on the work that ground stations cause: one for each address, and one for all. Sans-IO: time is passed in."""

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from enum import IntEnum
from typing import Self


@dataclass(frozen=True, slots=True)
class Rate:
    """A sustained rate per second, and a burst size."""

    per_s: float
    burst: float


class Cost(IntEnum):  # hashed for each datagram: as an int, in C
    """The limited kinds of work. Two limits: for one address, and for all together without proven rights.

    RECEIVED: a datagram or a read from a connection. The total is for addresses that are not known yet.
    CONTACT: an address that is not known yet, which costs memory for some seconds. FAR_CONTACT: one behind a router, as
    a forger can choose.
    ARRIVAL: a station that is served from now on, which costs greetings and a log entry. In a second there are fewer
    than places, so that they displace no station that sends heartbeats.
    ANSWER: a message sent on request. Mission Planner requests about sixty when it connects, most of them parameters.
    LIST: a list of all parameters, several hundred messages.
    TRANSFER: a message of a mission transfer. Over a fast link there may be a thousand items a second.
    TEXT: a STATUSTEXT that a station causes. A mission of 146 items may need one for each.
    UPLOAD: a list that is announced, which costs log entries.
    BOARD: a request to the flight controller, which has a few hundred bytes a second to spare.
    PASSED: a frame for an autopilot that speaks MAVLink itself, over a slow line.
    STORED: a list in the store that did not reach the flight controller.
    FLASH: a write to the flight controller's flash, whose pages endure 10,000 each: strangers would have to write for a
    month. A Harakiri with the mission extension has its own limit (docs/msp-mission.md).
    RECORDED: a ground station's frame in the telemetry log, whose space is mostly for the flight itself.
    """

    each: Rate
    total: Rate

    def __new__(cls, each: Rate, total: Rate) -> Self:
        cost = int.__new__(cls, len(cls.__members__))
        cost._value_, cost.each, cost.total = int(cost), each, total
        return cost

    RECEIVED = Rate(1500, 3000), Rate(15000, 15000)
    CONTACT = Rate(5, 32), Rate(50, 200)
    FAR_CONTACT = Rate(1, 8), Rate(10, 20)
    ARRIVAL = Rate(2, 16), Rate(10, 20)
    ANSWER = Rate(50, 600), Rate(500, 3000)
    LIST = Rate(1 / 2, 10), Rate(2, 40)
    TRANSFER = Rate(1000, 2000), Rate(1000, 8000)
    TEXT = Rate(5, 200), Rate(10, 300)
    UPLOAD = Rate(10, 50), Rate(10, 400)
    BOARD = Rate(4, 20), Rate(10, 40)
    PASSED = Rate(200, 600), Rate(200, 600)
    STORED = Rate(1 / 10, 20), Rate(1 / 5, 40)
    FLASH = Rate(1 / 600, 200), Rate(1 / 300, 400)
    RECORDED = Rate(50, 400), Rate(100, 800)


#: Addresses that are remembered after their stations have left: a new connection does not renew a budget.
_MAX_HOSTS = 1024


class TokenBucket:
    """Counts uses: `rate.burst` at once, of which `rate.per_s` are regained in a second."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        #: The uses not yet regained when it was last counted.
        self._used = 0.0
        self._counted_at = 0.0

    def spend(self, amount: float) -> None:
        """Count without asking. A negative amount takes back."""
        self._used += amount

    def take(self, now: float) -> bool:
        """Count one. False if it exceeds the limit."""
        used = max(0.0, self._used - max(0.0, now - self._counted_at) * self._rate.per_s)
        self._counted_at = now
        is_allowed = used + 1.0 <= self._rate.burst
        self._used = used + is_allowed
        return is_allowed


class Budget:
    """The limits of one address, for all stations there."""

    def __init__(self, totals: dict[Cost, TokenBucket]) -> None:
        self._totals = totals
        self._own: dict[Cost, TokenBucket] = {}

    def allows(self, cost: Cost, now: float, *, is_proven: bool = False) -> bool:
        """Count work. Returns False if it exceeds a limit. Work of a station with proven rights is not in the total."""
        own = self._own.get(cost)
        if own is None:
            own = self._own[cost] = TokenBucket(cost.each)
        if not own.take(now):
            return False
        if is_proven or self._totals[cost].take(now):
            return True
        own.spend(-1.0)
        return False


class Budgets:
    """The budgets of all addresses, and their totals."""

    def __init__(self) -> None:
        self.totals = {cost: TokenBucket(cost.total) for cost in Cost}
        self._hosts: OrderedDict[Hashable, Budget] = OrderedDict()  # the address asked for least recently first

    def of(self, host: Hashable) -> Budget:
        budget = self._hosts.pop(host, None) or Budget(self.totals)
        self._hosts[host] = budget
        if len(self._hosts) > _MAX_HOSTS:
            self._hosts.popitem(last=False)
        return budget
