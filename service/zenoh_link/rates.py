# SPDX-License-Identifier: GPL-3.0-or-later
"""The metered profile: a group every 5 s if it has changed, else every 30 s, like the state. Sans-IO.

Times are seconds of a monotonic clock.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import repeat
from math import inf
from typing import Any

from reports.vehicle_groups import Group

_CHANGED_S = 5.0
_IDLE_S = 30.0
_OVERVIEW_S = 10.0
#: The changes that count. Noise does not, nor does a field that is not listed.
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


@dataclass(slots=True)
class _Pace:
    """A sample at each multiple of `interval_s`, so that all groups share packets, and when its marks change."""

    interval_s: float
    marks: object = None
    due_at: float = -inf

    def admits(self, marks: object, now: float) -> bool:
        if now < self.due_at and marks == self.marks:
            return False
        self.due_at, self.marks = (now // self.interval_s + 1) * self.interval_s, marks
        return True


class SampleRates:
    """Decides for each sample whether it goes out. `marks`: values whose change is sent at once."""

    def __init__(self, *, is_metered: bool) -> None:
        self._is_metered = is_metered
        self._paces: defaultdict[Group, _Pace] = defaultdict(lambda: _Pace(_CHANGED_S))
        self._state, self._overview = _Pace(_IDLE_S), _Pace(_OVERVIEW_S)
        #: Each group's last sample, and when the next goes out even if it is nearly the same.
        self._last: dict[Group, tuple[Any, float]] = {}
        #: Groups whose newest sample came too early to be sent.
        self.held_back: set[Group] = set()

    def admits(self, group: Group, sample: Any, now: float, *, gathered: bool = False) -> bool:
        """True if this sample goes out now. `gathered`: together with all others that are held back."""
        if not self._is_metered:
            return True
        marks = [getattr(sample, name) for name in _AT_ONCE.get(group, ())]
        pace = self._paces[group]
        is_urgent = group not in self._last or marks != pace.marks
        admitted = (
            (gathered or is_urgent) and pace.admits(marks, now) and (is_urgent or self._is_news(group, sample, now))
        )
        if admitted:
            self._last[group] = sample, (now // _IDLE_S + 1) * _IDLE_S
        (self.held_back.discard if admitted else self.held_back.add)(group)
        return admitted

    def admits_state(self, marks: object, now: float) -> bool:
        return not self._is_metered or self._state.admits(marks, now)

    def admits_overview(self, marks: object, now: float) -> bool:
        """Equal in both profiles."""
        return self._overview.admits(marks, now)

    def _is_news(self, group: Group, sample: Any, now: float) -> bool:
        """True if a sample differs noticeably from the last, or the last is long ago."""
        last, until = self._last[group]
        return now >= until or any(
            _differs(getattr(sample, field), getattr(last, field), step) for field, step in _CHANGES[group].items()
        )


def _differs(value: Any, before: Any, step: float) -> bool:
    """True if a number, or any of several, has changed by `step`. Other values count any change."""
    if value == before:
        return False
    if isinstance(value, int | float) and isinstance(before, int | float):
        return abs(value - before) >= step
    if isinstance(value, tuple) and isinstance(before, tuple) and len(value) == len(before):
        return any(map(_differs, value, before, repeat(step)))
    return True
