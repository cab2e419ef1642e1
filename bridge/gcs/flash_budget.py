# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits the writes to the flight controller's flash, whose pages endure 10,000 each. Sans-IO.

All ground stations on open links together get 400 writes at once and 12 an hour: to wear out a page, strangers would
have to write for a month. A Harakiri with the mission extension has its own limit (docs/msp-mission.md).
"""

from collections.abc import Callable, Hashable

from bridge.gcs.budget import Shares, TokenBucket
from bridge.gcs.cost import Rate
from bridge.gcs.guard import Standing
from bridge.gcs.station import Peer
from bridge.gcs.stations import PRECEDENCE, Stations

_WRITES = Rate(1 / 300, 400)

#: The text for a ground station whose share is used up.
TOO_MANY_WRITES = "Flash wear limit: try again in 10 minutes"


class FlashBudget:
    """Shares the writes between the hosts with precedence on an open link; all others have one account.

    The last writes are kept for hosts that have not written lately, one for each. Of the rest, a host may use up
    to twice as many as it leaves: alone it gets 257 at once and 7 an hour. A host that gains precedence takes over
    the account of one that has lost it: changing addresses gains nothing.

    A peer with the key or a listed address has its own budget, but its writes also count for the others.
    """

    def __init__(self, standing: Callable[[Peer], Standing], stations: Stations) -> None:
        self._standing = standing
        self._stations = stations
        self._shares = Shares(_WRITES)
        #: The hosts with precedence, and those that had it, each with its own account.
        self._accounts: set[Hashable] = set()
        self._proven: dict[Hashable, TokenBucket] = {}

    def allows(self, peer: Peer, now: float) -> bool:
        """Count a write; False if it must wait."""
        self._open_accounts()
        account = self._account(peer)
        left, used = self._shares.left(now), self._shares.used(account)
        if self._standing(peer) is Standing.PROVEN:
            bucket = self._proven.setdefault(account, TokenBucket(_WRITES))
            if not bucket.has(now):
                return False
            bucket.spend()
        elif left <= min((PRECEDENCE + 1) * used, PRECEDENCE + used / 2):
            return False
        self._shares.spend(account)
        return True

    def not_written(self, peer: Peer) -> None:
        """Take back a write: the flash held the same already, or the flight controller refused."""
        account = self._account(peer)
        self._shares.spend(account, -1.0)
        if (bucket := self._proven.get(account)) is not None:
            bucket.spend(-1.0)

    def used(self, peer: Peer) -> float:
        return self._shares.used(self._account(peer))

    def _account(self, peer: Peer) -> Hashable:
        is_proven = self._standing(peer) is Standing.PROVEN
        return peer.host if is_proven or self._stations.has_standing(peer) else None

    def _open_accounts(self) -> None:
        present = self._stations.hosts_with_precedence()
        left = sorted(self._accounts - present.keys(), key=self._shares.used)
        for host in present:
            if host not in self._accounts:
                self._accounts.add(host)
                if left:
                    self._accounts.remove(left[0])
                    self._shares.hand_over(left.pop(0), host)
