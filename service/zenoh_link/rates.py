# SPDX-License-Identifier: GPL-3.0-or-later
"""The rate of each group: the profile, the owner's limits, and for a while a subscriber's request. Sans-IO.

Times are seconds of a monotonic clock.
"""

from collections.abc import Mapping
from itertools import repeat
from math import inf
from typing import Any

from bridge.model.vehicle_groups import Group
from service.settings.zenoh import STATE_NAME, ZenohProfile

#: The metered profile: a group every 5 s if it has changed, else every 30 s, like the state.
_METERED_S = 5.0
_IDLE_S = 30.0
_OVERVIEW, _OVERVIEW_S = "overview", 10.0
#: The changes that count; noise does not, nor does a field that is not listed.
_CHANGES: Mapping[Group, Mapping[str, float]] = {
    Group.ATTITUDE: {"roll_deg": 2, "pitch_deg": 2, "heading_deg": 5},
    Group.POSITION: {"lat_deg": 2e-5, "lon_deg": 2e-5, "height_m": 1, "climb_m_s": 0.5, "home_lat_deg": 1e-7},
    Group.GPS: {"satellites": 2, "ground_speed_m_s": 1},
    Group.BATTERY: {"voltage_v": 0.2, "current_a": 1, "drawn_mah": 50, "remaining_percent": 2},
    Group.RC: {"channels_us": 50, "rssi_percent": 10},
    Group.STATUS: {"sensors": 0, "i2c_errors": 10},
    Group.LINK: {"ground_stations": 0, "requests_lost": 10, "bad_checksums": 10},
}
#: Changes that are sent at once.
_AT_ONCE = {Group.STATUS: ("armed", "mode"), Group.GPS: ("fix",), Group.LINK: ("state", "flight_controller")}
#: Groups with this interval or more share packets: each packet costs 100 bytes of headers.
GATHERED_FROM_S = 1.0
#: A subscriber's request expires, because the owner pays for the data.
MAX_REQUEST_S = 3600.0
MAX_REQUEST_HZ = 50.0


class SampleRates:
    """Decides for each sample whether it goes out. Names are those of the groups, and "state"."""

    def __init__(self, profile: ZenohProfile, limits_hz: Mapping[str, float]) -> None:
        usual = {group.value: _METERED_S for group in Group} | {STATE_NAME: _IDLE_S}
        self._interval_s = usual if profile is ZenohProfile.METERED else {}
        #: The groups sent more rarely while unchanged, each with the values of its last sample.
        self._last: dict[str, Any] = dict.fromkeys(self._interval_s.keys() - {STATE_NAME} - limits_hz.keys())
        self._idle_until: dict[str, float] = {}
        self._interval_s |= {_OVERVIEW: _OVERVIEW_S} | {name: 1 / hz if hz else inf for name, hz in limits_hz.items()}
        self._requests: dict[str, tuple[float, float]] = {}
        self._due_at: dict[str, float] = {}
        self._sent: dict[str, object] = {}
        #: Groups whose newest sample came too early to be sent.
        self.held_back: set[Group] = set()

    def admits(self, group: Group, sample: Any, now: float, *, gathered: bool = False) -> bool:
        """True if this sample goes out now. `gathered`: together with all others that are held back."""
        if group.value not in self._interval_s:
            return True
        name = group.value
        marks = [getattr(sample, name) for name in _AT_ONCE.get(group, ())]
        waits = not gathered and self._current_s(name, now) >= GATHERED_FROM_S
        is_idle = self._is_idle(group, sample, now)
        admitted = (not waits or marks != self._sent.get(name)) and self._admits(name, marks, now, is_idle=is_idle)
        if admitted and name in self._last:
            self._last[name] = sample
            self._idle_until[name] = (now // _IDLE_S + 1) * _IDLE_S
        (self.held_back.discard if admitted else self.held_back.add)(group)
        return admitted

    def admits_state(self, marks: object, now: float) -> bool:
        """True if the state goes out now. `marks`: values whose change is sent at once."""
        return STATE_NAME not in self._interval_s or self._admits(STATE_NAME, marks, now)

    def admits_overview(self, marks: object, now: float) -> bool:
        """True if the overview goes out now. `marks`: values whose change is sent at once."""
        return self._admits(_OVERVIEW, marks, now)

    def request(self, name: str, rate_hz: float, until: float) -> None:
        """Raise a rate until that time. The owner's own rate stays the minimum."""
        self._requests[name] = (1 / rate_hz, until)
        self._due_at.pop(name, None)

    def describe(self, now: float) -> dict[str, float | None]:
        """The current maximum rate of each name, Hz; None: as fast as the flight controller is polled."""
        names = [group.value for group in Group] + [STATE_NAME]
        return {name: round(1 / self._current_s(name, now), 3) if name in self._interval_s else None for name in names}

    def _is_idle(self, group: Group, sample: Any, now: float) -> bool:
        """True if a sample is nearly the same as the last one, which is not long ago."""
        name, last = group.value, self._last.get(group.value)
        if last is None or now >= self._idle_until[name] or self._is_requested(name, now):
            return False
        return not any(
            _differs(getattr(sample, field), getattr(last, field), step) for field, step in _CHANGES[group].items()
        )

    def _admits(self, name: str, marks: object, now: float, *, is_idle: bool = False) -> bool:
        """True if a sample is due and not idle, or if `marks` differ from those of the last one."""
        interval_s = self._current_s(name, now)
        if interval_s == inf or (now < self._due_at.get(name, -inf) and self._sent.get(name) == marks):
            return False
        # The same instants for all groups, so that they share packets; and 10 Hz becomes 4 Hz, not 3.3.
        self._due_at[name] = (now // interval_s + 1) * interval_s
        if is_idle and self._sent.get(name) == marks:
            return False
        self._sent[name] = marks
        return True

    def _current_s(self, name: str, now: float) -> float:
        interval_s = self._interval_s[name]
        return min(interval_s, self._requests[name][0]) if self._is_requested(name, now) else interval_s

    def _is_requested(self, name: str, now: float) -> bool:
        return name in self._requests and now < self._requests[name][1]


def _differs(value: Any, before: Any, step: float) -> bool:
    """True if a number, or any of several, has changed by `step`; other values count any change."""
    if value == before:
        return False
    if isinstance(value, int | float) and isinstance(before, int | float):
        return abs(value - before) >= step
    if isinstance(value, tuple) and isinstance(before, tuple) and len(value) == len(before):
        return any(map(_differs, value, before, repeat(step)))
    return True
