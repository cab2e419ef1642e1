# SPDX-License-Identifier: GPL-3.0-or-later
"""The message rates of each ground station: as requested, else the defaults. Sans-IO.

Intervals are in seconds; infinity: never.
"""

from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridge.gcs.ground_station import GroundStation

#: Messages a second to all stations together, in equal shares: the defaults are 46 for each.
_MOST_PER_S = 1200
#: A station may get the share of this time in one burst.
_BURST_S = 1.0
#: A message due within this fraction of the interval is sent now, because the readings arrive at their own rate.
_EARLY = 0.25


class MessageRates:
    """One station's requests and schedule, by message id.

    Each message uses some of the share. Messages are sent while `used_until` is not more than a burst ahead.
    """

    __slots__ = "due", "requested", "used_until"

    def __init__(self) -> None:
        self.requested: dict[int, float] = {}
        self.due: dict[int, float] = {}
        self.used_until = -inf

    def request(self, msgid: int, interval_s: float | None) -> None:
        """Set the interval that the station requests, or None for the default."""
        self.due.pop(msgid, None)
        if interval_s is None:
            self.requested.pop(msgid, None)
        else:
            self.requested[msgid] = interval_s


def fastest_s(stations: Sequence["GroundStation"], defaults_s: Mapping[int, float]) -> Mapping[int, float]:
    """The shortest interval for each message."""
    return {
        msgid: min((station.rates.requested.get(msgid, default_s) for station in stations), default=inf)
        for msgid, default_s in defaults_s.items()
    }


def take_due(stations: Sequence["GroundStation"], msgid: int, default_s: float, now: float) -> list["GroundStation"]:
    """The stations for which the message is due now. Schedules the next for each."""
    taken, cost_s = [], len(stations) / _MOST_PER_S
    for station in stations:
        rates = station.rates
        if rates.used_until > now + _BURST_S:
            continue
        interval_s = rates.requested.get(msgid, default_s)
        due = rates.due.get(msgid, -inf)
        if interval_s == inf or now < due - interval_s * _EARLY:
            continue
        rates.used_until = max(rates.used_until, now) + cost_s
        # Counted from the due time to keep the rate, but missed messages are not caught up.
        rates.due[msgid] = (due if now < due + interval_s else now) + interval_s
        taken.append(station)
    return taken
