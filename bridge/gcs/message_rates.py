# SPDX-License-Identifier: GPL-3.0-or-later
"""Message rates of each ground station: as requested, else the defaults. Sans-IO."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import inf

from bridge.gcs.station import Peer

#: Messages a second to all peers with standing together: at least 75 for each of the 16 on a link. The defaults are 55.
_MOST_PER_S = 1200
#: The same to all other peers: telemetry for a crowd must leave a Pi Zero time for the pilot.
_MOST_TO_OTHERS_PER_S = 400
#: A peer may get its share of this time in one burst.
_BURST_S = 1.0
#: A message due within this fraction of its interval is sent now, because the readings arrive at their own rate.
_EARLY = 0.25
#: The shortest interval for an unwatched peer, s. The default rates would cost a Pi Zero twice the CPU.
_UNWATCHED_S = 0.1


class _Follower:
    """A peer's requests and schedule, by message id. No interval is below `shortest_s`.

    Each message uses `cost_s` of its time; messages are sent while `used_until` is not more than a burst ahead.
    """

    def __init__(self, cost_s: float) -> None:
        self.requested: dict[int, float] = {}
        self.due: dict[int, float] = {}
        self.shortest_s = 0.0
        self.cost_s = cost_s
        self.used_until = -inf

    def interval_s(self, msgid: int, default_s: float) -> float:
        return max(self.requested.get(msgid, default_s), self.shortest_s)


class MessageRates:
    """Intervals in seconds; infinity: never. `defaults` holds every known message id."""

    def __init__(self, defaults: Mapping[int, float]) -> None:
        self._defaults = defaults
        self._followers: dict[Peer, _Follower] = {}
        self._newcomers_cost_s = 1 / _MOST_PER_S

    def request(self, peer: Peer, msgid: int, interval_s: float | None) -> None:
        """Set the interval that a ground station requests; None: the default."""
        follower = self._follower(peer)
        follower.due.pop(msgid, None)
        if interval_s is None:
            follower.requested.pop(msgid, None)
        else:
            follower.requested[msgid] = interval_s

    def interval_s(self, peer: Peer, msgid: int) -> float:
        """The interval requested by a ground station, or the default."""
        follower, default_s = self._followers.get(peer), self._defaults[msgid]
        return default_s if follower is None else follower.interval_s(msgid, default_s)

    def fastest_s(self, peers: Iterable[Peer]) -> dict[int, float]:
        """The shortest interval of `peers` for each message."""
        # The others all have the defaults.
        alike = {peer if self._is_special(peer) else None: peer for peer in peers}.values()
        return {msgid: min((self.interval_s(peer, msgid) for peer in alike), default=inf) for msgid in self._defaults}

    def withhold(self, peer: Peer, msgid: int, until: float) -> None:
        """Send a ground station the next such message at `until`."""
        self._follower(peer).due[msgid] = until

    def take_due(self, msgid: int, peers: Sequence[Peer], now: float) -> list[Peer]:
        """The peers for which the message is due now; schedules the next one for each."""
        taken = []
        default_s = self._defaults[msgid]
        for peer in peers:
            follower = self._followers.get(peer) or self._follower(peer)
            if follower.used_until > now + _BURST_S:
                continue
            interval_s = follower.interval_s(msgid, default_s)
            due = follower.due.get(msgid, -inf)
            if interval_s == inf or now < due - interval_s * _EARLY:
                continue
            follower.used_until = max(follower.used_until, now) + follower.cost_s
            # Counted from the due time to keep the rate, but missed messages are not caught up.
            follower.due[msgid] = (due if now < due + interval_s else now) + interval_s
            taken.append(peer)
        return taken

    def keep(self, peers: Iterable[Peer], with_standing: Collection[Peer], unwatched: Collection[Peer] = ()) -> None:
        """Forget all other peers. `with_standing`: those whose share does not depend on the number of the others.

        `unwatched`: those at whose end there may be no station; they get no message more than ten times a second.
        """
        self._followers = {peer: self._follower(peer) for peer in peers}
        newcomers = len(self._followers) - len(with_standing)
        cost_s = len(with_standing) / _MOST_PER_S
        self._newcomers_cost_s = max(newcomers, 1) / _MOST_TO_OTHERS_PER_S
        for peer, follower in self._followers.items():
            follower.cost_s = cost_s if peer in with_standing else self._newcomers_cost_s
            follower.shortest_s = _UNWATCHED_S if peer in unwatched else 0.0

    def _follower(self, peer: Peer) -> _Follower:
        follower = self._followers.get(peer)
        if follower is None:
            follower = self._followers[peer] = _Follower(self._newcomers_cost_s)
        return follower

    def _is_special(self, peer: Peer) -> bool:
        follower = self._followers.get(peer)
        return follower is not None and bool(follower.requested or follower.shortest_s)
