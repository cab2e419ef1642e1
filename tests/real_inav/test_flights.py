# SPDX-License-Identifier: GPL-3.0-or-later
"""Each row of the table in docs/inav.md is flown as it says, on INAV's own SITL."""

import pytest

from bridge.model.ground_track import Place
from protocols.msp.inav_places import Corner
from protocols.msp.nav import NavRecord, NavStatus
from tests.support.inav_lists import place
from tests.support.inav_sitl import Sitl
from tests.support.nav_flight import USUAL_M, USUAL_MS, Leg, NavFlight
from tests.support.nav_rows import ROWS, Row

_OTHER_MS = 5.0
#: Rows whose flight only repeats another's, but longer, or which ends in the ground of the physics.
_LEFT_OUT = ("WAYPOINT, Delay 70", "WAYPOINT 600 m away", "WAYPOINT at -5 m", "WAYPOINT at 150 m")


def flown_rows() -> list[Row]:
    """One row for each list of records."""
    rows = {row.verdict("inav").records: row for row in reversed(ROWS) if row.inav and row.name not in _LEFT_OUT}
    return list(reversed(rows.values()))


class SitlFlight(NavFlight):
    """The SITL's craft, with its deviations from the whole values of the table taken off."""

    sample_s = 0.4

    def __init__(self, sitl: Sitl, records: tuple[NavRecord, ...], longest_s: float) -> None:
        super().__init__(records)
        self._sitl, self.longest_s = sitl, longest_s
        self._status = sitl.nav_status()

    def now_s(self) -> float:
        return self._sitl.now_s

    def run(self, seconds: float) -> None:
        self._sitl.run(seconds)

    def status(self) -> NavStatus:
        """Of a craft that has landed and disarmed, the last in flight."""
        if self._sitl.is_armed():
            self._status = self._sitl.nav_status()
        return self._status

    def place(self) -> Place:
        north, west, _ = self._sitl.place
        return Corner(*place(north, -west))

    def height_m(self) -> float:
        height_m = round(self._sitl.place[2])
        return USUAL_M if abs(height_m - USUAL_M) <= 2 else height_m

    def speed_ms(self) -> float:
        return self._sitl.speed_m_s

    def cruise_ms(self, leg: Leg) -> float:
        speeds = sorted(leg.speeds)
        return min((USUAL_MS, _OTHER_MS), key=lambda usual: abs(usual - speeds[len(speeds) * 3 // 4]))

    def is_landed(self, status: NavStatus) -> bool:
        return not self._sitl.is_armed()

    def height_is_steady(self) -> bool:
        before = self._sitl.place[2]
        self._sitl.run(2)
        return abs(self._sitl.place[2] - before) < 0.5


@pytest.mark.parametrize("row", flown_rows(), ids=lambda row: row.name)
def test_each_row_is_flown_as_documented(sitl: Sitl, row: Row) -> None:
    verdict = row.verdict("inav")
    longest_s = 60 if row.inav == "never ends" or "stays" in row.inav else 240
    sitl.configure(nav_auto_speed=300)
    sitl.fly(verdict.records)
    assert SitlFlight(sitl, verdict.records, longest_s).summary() == row.inav
