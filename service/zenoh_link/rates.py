# SPDX-License-Identifier: GPL-3.0-or-later
"""The rate of each group: the profile, the owner's limits, and for a while a subscriber's request. Sans-IO.

Times are seconds of a monotonic clock.
"""

from collections.abc import Mapping
from math import inf
from typing import Any

from bridge.model.vehicle_groups import Group
from service.settings.zenoh import STATE_NAME, ZenohProfile

#: The metered profile: each group every 5 s, the state every 15 s, and changes of the fields below at once.
_METERED_S = 5.0
_METERED_STATE_S = 15.0
_AT_ONCE = {Group.STATUS: ("armed", "mode"), Group.GPS: ("fix",), Group.LINK: ("state", "flight_controller")}
#: Groups with this interval or more share packets, each of which costs 100 bytes of headers.
GATHERED_FROM_S = 1.0
#: A subscriber's request expires, because the owner pays for the data.
MAX_REQUEST_S = 3600.0
MAX_REQUEST_HZ = 50.0


class SampleRates:
    """Decides for each sample whether it goes out. Names are those of the groups, and "state"."""

    def __init__(self, profile: ZenohProfile, limits_hz: Mapping[str, float]) -> None:
        usual = {group.value: _METERED_S for group in Group} | {STATE_NAME: _METERED_STATE_S}
        self._interval_s = usual if profile is ZenohProfile.METERED else {}
        self._interval_s |= {name: 1 / hz if hz else inf for name, hz in limits_hz.items()}
        self._requests: dict[str, tuple[float, float]] = {}
        self._due_at: dict[str, float] = {}
        self._sent: dict[str, object] = {}
        #: Groups whose newest sample came too early to be sent.
        self.held_back: set[Group] = set()

    def admits(self, group: Group, sample: Any, now: float, *, gathered: bool = False) -> bool:
        """True if this sample goes out now. `gathered`: together with all others that are held back."""
        if group.value not in self._interval_s:
            return True
        marks = [getattr(sample, name) for name in _AT_ONCE.get(group, ())]
        waits = not gathered and self._current_s(group.value, now) >= GATHERED_FROM_S
        admitted = (not waits or marks != self._sent.get(group.value)) and self._admits(group.value, marks, now)
        (self.held_back.discard if admitted else self.held_back.add)(group)
        return admitted

    def admits_state(self, marks: object, now: float) -> bool:
        """True if the state goes out now. `marks`: values whose change is sent at once."""
        return STATE_NAME not in self._interval_s or self._admits(STATE_NAME, marks, now)

    def request(self, name: str, rate_hz: float, until: float) -> None:
        """Raise a rate until that time. The owner's own rate stays the minimum."""
        self._requests[name] = (1 / rate_hz, until)
        self._due_at.pop(name, None)

    def describe(self, now: float) -> dict[str, float | None]:
        """The present maximum rate of each name, Hz; None: as fast as the flight controller is polled."""
        names = [group.value for group in Group] + [STATE_NAME]
        return {name: round(1 / self._current_s(name, now), 3) if name in self._interval_s else None for name in names}

    def _admits(self, name: str, marks: object, now: float) -> bool:
        """True if a sample is due, or if `marks` differ from those of the last one."""
        interval_s = self._current_s(name, now)
        if interval_s == inf or (now < self._due_at.get(name, -inf) and self._sent.get(name) == marks):
            return False
        self._sent[name] = marks
        # The same instants for all groups, so that they share packets; and 10 Hz becomes 4 Hz, not 3.3.
        self._due_at[name] = (now // interval_s + 1) * interval_s
        return True

    def _current_s(self, name: str, now: float) -> float:
        interval_s = self._interval_s[name]
        requested_s, until = self._requests.get(name, (inf, -inf))
        return min(interval_s, requested_s) if now < until else interval_s
