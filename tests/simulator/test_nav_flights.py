# SPDX-License-Identifier: GPL-3.0-or-later
"""Each row of the table in docs/inav.md is written to the simulated board and flown there by the firmware's rules."""

from pathlib import Path

import pytest

from bridge.model.ground_track import Place
from protocols.mission_item import Command
from protocols.msp.nav import NavRecord, NavStatus, decode_nav_status
from reports.verdict import Result
from simulator.board.flight import FlightState
from simulator.board.nav_waypoint import unpack_waypoint
from simulator.board.options import Faults
from simulator.inav.boxes import BOXES, NAV_WP
from tests.support.msp_bench import MspBench, waypoint
from tests.support.nav_flight import NavFlight
from tests.support.nav_rows import ROWS, Row, table

PAGE = Path(__file__).parents[2] / "docs" / "inav.md"
SWITCH = {"inav": 1 << BOXES["9.1.0"].index(NAV_WP), "multiwii": 1 << 10}
LANDED, LANDING = 10, 9


class Flight(NavFlight):
    """A list flown by a simulated board."""

    def __init__(self, kind: str, records: tuple[NavRecord, ...]) -> None:
        super().__init__(records)
        self.bench = MspBench(kind, faults=Faults(boxes=0))
        self._kind = kind
        if kind == "multiwii":
            # The previous list was longer; its last records are still in the EEPROM.
            self.bench.upload([waypoint(90 + number) for number in range(12)])
        self.bench.upload([unpack_waypoint(b"\0" + record.pack())[1] for record in records])
        self.bench.faults.armed, self.bench.faults.boxes = True, SWITCH[kind]

    def now_s(self) -> float:
        return self.bench.now

    def run(self, seconds: float) -> None:
        self.bench.run(seconds)

    def status(self) -> NavStatus:
        status = decode_nav_status(self.bench.payload(121))
        assert status is not None
        return status

    def place(self) -> Place:
        return self._truth()

    def height_m(self) -> float:
        return self._truth().height_m

    def speed_ms(self) -> float:
        return self._truth().speed_ms

    def is_landed(self, status: NavStatus) -> bool:
        is_down = status.state == LANDING and self._kind == "inav" and self.height_m() <= 0
        return status.state == LANDED or is_down

    def height_is_steady(self) -> bool:
        before = self.height_m()
        self.bench.run(0.5)
        return before == self.height_m()

    def _truth(self) -> FlightState:
        truth = self.bench.board.truth(self.bench.now)
        assert truth is not None
        return truth.flight


@pytest.mark.parametrize("kind", ["inav", "multiwii"])
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_each_row_is_flown_as_documented(row: Row, kind: str) -> None:
    verdict, expected = row.verdict(kind), getattr(row, kind)
    if not expected:
        assert verdict.result is Result.REJECTED
        return
    assert verdict.result is Result.ACCEPTED, verdict.findings
    flown = Flight(kind, verdict.records).summary()
    assert flown == expected


def test_every_supported_command_has_a_row() -> None:
    flown = {command for command in Command if command < Command.FENCE_RETURN_POINT}  # the others are places
    assert {item.command for row in ROWS for item in row.items} >= flown


def test_the_page_has_the_table() -> None:
    _, rest = PAGE.read_text().split("<!-- begin: make inav-page -->\n")
    found, _ = rest.split("<!-- end: make inav-page -->\n")
    assert found == table(), "run make inav-page"
