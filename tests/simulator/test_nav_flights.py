# SPDX-License-Identifier: GPL-3.0-or-later
"""Each row of the table in docs/inav.md is written to the simulated board and flown there by the firmware's rules."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from bridge.model.ground_track import distance_m
from protocols.mission_item import Command
from protocols.msp.nav import LEGS, NavAction, NavRecord
from reports.verdict import Result
from simulator.board.nav_waypoint import unpack_waypoint
from simulator.board.options import Faults
from simulator.inav.boxes import BOXES, NAV_WP
from tests.support.msp_bench import MspBench, waypoint
from tests.support.nav_rows import ROWS, Row, table

PAGE = Path(__file__).parents[2] / "docs" / "inav.md"
SWITCH = {"inav": 1 << BOXES["9.1.0"].index(NAV_WP), "multiwii": 1 << 10}
LONGEST_S = 600.0
TOO_FAR, FINISHED, HOVERS_AT_HOME, LANDED, HOLDS, HOLDS_FOR_EVER, LANDING = 1, 4, 13, 10, 4, 3, 9
USUAL_MS, USUAL_M, SHORT_M = 3.0, 20.0, 5.0


@dataclass
class Leg:
    """A record that was flown to, the seconds held there, and the maximum speed on the way."""

    number: int
    held_s: float = 0.0
    speeds: list[float] = field(default_factory=list)


class Flight:
    """A list flown from the ground to its end."""

    def __init__(self, kind: str, records: tuple[NavRecord, ...]) -> None:
        self.bench = MspBench(kind, faults=Faults(boxes=0))
        self._kind = kind
        if kind == "multiwii":
            # The previous list was longer; its last records are still in the EEPROM.
            self.bench.upload([waypoint(90 + number) for number in range(12)])
        self.bench.upload([unpack_waypoint(b"\0" + record.pack())[1] for record in records])
        self._last = records[-1]
        self.bench.faults.armed, self.bench.faults.boxes = True, SWITCH[kind]
        self.legs: list[Leg] = []
        self.end = self._fly()

    def _fly(self) -> str:
        began = before = self.bench.now
        while self.bench.now < began + LONGEST_S:
            self.bench.run(0.2)
            _, state, action, number, error = struct.unpack("<5Bh", self.bench.payload(121))[:5]
            seconds, before = self.bench.now - before, self.bench.now
            if error == TOO_FAR:
                return "stops"
            if action in (NavAction.JUMP, NavAction.SET_POI, NavAction.SET_HEAD) or not state:
                if error == FINISHED and self._height_is_steady():
                    return "hovers"
                continue
            if not self.legs or self.legs[-1].number != number:
                self.legs.append(Leg(number))
            elif state == HOLDS:
                self.legs[-1].held_s += seconds
            truth = self.bench.board.truth(self.bench.now)
            assert truth is not None
            self.legs[-1].speeds.append(truth.flight.speed_ms)
            if end := self._ended(state, action, error):
                return end
        return "(stays)" if self.legs[-1].held_s > LONGEST_S / 2 else "never ends"

    def _ended(self, state: int, action: int, error: int) -> str:
        if state == LANDED or (state == LANDING and self._kind == "inav" and self._height() <= 0):
            return "lands at home" if action == NavAction.RTH else "lands"
        if action == NavAction.RTH and state in (HOVERS_AT_HOME, HOLDS_FOR_EVER):
            return "hovers at home"
        if error == FINISHED and self._height_is_steady():
            return "lands" if action == NavAction.LAND else "hovers"
        return ""

    def _height(self) -> float:
        truth = self.bench.board.truth(self.bench.now)
        assert truth is not None
        return truth.flight.height_m

    def _height_is_steady(self) -> bool:
        before = self._height()
        self.bench.run(0.5)
        return before == self._height()

    def summary(self) -> str:
        """The table's text: only unusual facts are given."""
        if self.end == "never ends":
            return self.end
        words = []
        for leg in self.legs:
            speed = max(leg.speeds[1:] or leg.speeds)  # the first sample may still belong to the previous leg
            words.append(str(leg.number))
            if leg.held_s > 1 and self.end != "(stays)":
                words.append(f"({round(leg.held_s)} s)")
            if speed > USUAL_MS + 0.1:
                words.append(f"({speed:g} m/s)")
        at = f" at {self._height():g} m" if self.end == "hovers" and abs(self._height() - USUAL_M) > 0.5 else ""
        return " ".join([*words, self.end]) + at + " short of it" * (self.end == "hovers" and self._is_short())

    def _is_short(self) -> bool:
        truth = self.bench.board.truth(self.bench.now)
        assert truth is not None
        return self._last.action in LEGS and distance_m(truth.flight, self._last) > SHORT_M


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
