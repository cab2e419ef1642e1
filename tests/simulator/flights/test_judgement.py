# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions judged by their true track: what is flown, and each thing that is not."""

from dataclasses import dataclass, field, replace
from xml.etree import ElementTree

import pytest

from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.flights.judgement import ItemResult, extremes, is_flown, judge
from simulator.flights.mission_run import MissionRun, Report
from simulator.flights.track import Sample, Track
from simulator.flights.track_picture import track_svg
from simulator.sky.earth import Place

PLACE = Place()


def record(command: WpCommand, north: float = 0.0, height: int = 10, **fields: int) -> WpRecord:
    lat, lon = PLACE.coordinates((north, 0.0, 0.0))
    plain = WpRecord(round(lat * 1e7), round(lon * 1e7), height, 0, 0, 2, 0, command)
    return plain._replace(**fields)


HOME = record(WpCommand.WAYPOINT, height=0)
QUIET = FlightProgress(FlightPhase.LEG, FlightReason.NONE, True, True, True, False, 1, None, 4, 0.0, 0.0, 0.0, 0.0)


@dataclass(slots=True)
class Flight:
    """A flight told second by second; the craft is still between two calls of `go`."""

    now: float = 0.0
    north: float = 0.0
    height: float = 10.0
    heading: float = 0.0
    armed: bool = True
    track: Track = field(default_factory=Track)
    reports: list[Report] = field(default_factory=list)
    progress: FlightProgress = QUIET

    def go(self, seconds: float, north: float = 0.0, turn: float = 0.0, up: float = 0.0) -> "Flight":
        """Move by these metres and degrees."""
        steps = round(seconds * 10)
        for _ in range(steps):
            self.now += 0.1
            self.north += north / steps
            self.heading = (self.heading + turn / steps) % 360
            self.height += up / steps
            position = (self.north, 0.0, self.height)
            self.track.samples.append(Sample(self.now, position, (0.0, 0.0, 0.0), self.heading, 0.0, self.armed))
            self.reports.append(Report(self.now, self.progress))
        return self

    def say(self, **changed: object) -> "Flight":
        self.progress = replace(self.progress, **changed)  # type: ignore[arg-type]
        return self

    def judged(self, *records: WpRecord, landed: bool = False, ended: bool = True) -> list[ItemResult]:
        run = MissionRun((HOME, *records), 0.0, self.track, self.reports, ended, landed)
        return judge(run, PLACE)


def test_a_waypoint_is_flown() -> None:
    flight = Flight().go(30, north=49).say(reached=1, record=2).go(5, north=1)
    (result,) = flight.judged(record(WpCommand.WAYPOINT, 50.0, time=1))
    assert is_flown([result])
    assert result.reached_s == pytest.approx(30, abs=0.3)
    assert result.distance_m == pytest.approx(1.0, abs=0.3)
    assert result.height_m == pytest.approx(10)
    assert result.overshoot_m == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(("onward", "overshoot"), [(80.0, 0.0), (54.0, 8.0), (20.0, 12.0)])
def test_the_way_to_the_next_place_is_not_an_overshoot(onward: float, overshoot: float) -> None:
    flight = Flight().go(20, north=50).say(reached=1, record=2).go(9, north=12).go(9, north=onward - 62).say(reached=2)
    first, _ = flight.go(1).judged(*(record(WpCommand.WAYPOINT, north, time=1) for north in (50.0, onward)))
    assert first.overshoot_m == pytest.approx(overshoot, abs=0.1)


@pytest.mark.parametrize(
    ("flight", "records", "problem"),
    [
        (Flight().go(20, north=30), [record(WpCommand.WAYPOINT, 50.0)], "not reached"),
        (
            Flight().go(20, north=44).say(reached=1).go(5),
            [record(WpCommand.WAYPOINT, 50.0)],
            "6.0 m away when it counted as reached",
        ),
        (
            Flight().go(20, north=50).say(reached=1).go(3, north=5).go(3),
            [record(WpCommand.WAYPOINT, 50.0, time=1)],
            "overshoot 5.0 m",
        ),
        (
            Flight().go(20, north=50).say(reached=1, state=FlightPhase.LOITER).go(4).say(state=FlightPhase.DONE).go(5),
            [record(WpCommand.LOITER_TIME, 50.0, time=10)],
            "stayed 3.9 s instead of 10 s",
        ),
        (
            Flight()
            .go(20, north=50)
            .say(reached=1, state=FlightPhase.TURN)
            .go(8, turn=300)
            .say(state=FlightPhase.DONE),
            [record(WpCommand.LOITER_TURNS, 50.0, turns=1)],
            "turned",
        ),
        (
            Flight().go(20, north=50).say(reached=1, state=FlightPhase.STAY).go(9, north=-8),
            [record(WpCommand.LOITER_UNLIM, 50.0)],
            "up to 8.0 m away while it stayed",
        ),
        (
            Flight().go(20, north=50).say(reached=1, state=FlightPhase.STAY).go(9, up=-4),
            [record(WpCommand.LOITER_UNLIM, 50.0)],
            "6.0 m high instead of 10 m",
        ),
        (Flight().go(20, north=50).say(reached=1).go(5), [record(WpCommand.LOITER_TIME, 50.0)], "it did not stay"),
        (Flight(height=3.0).go(9).say(reached=1).go(1), [record(WpCommand.TAKEOFF)], "only 3.0 m high"),
        (Flight().go(9), [record(WpCommand.LAND)], "not landed"),
        (
            Flight().go(9, north=9).say(reached=1, state=FlightPhase.HELD, reason=FlightReason.STALLED).go(5),
            [record(WpCommand.WAYPOINT, 9.0)],
            "the flight was stopped: stalled",
        ),
    ],
)
def test_each_fault_is_named(flight: Flight, records: list[WpRecord], problem: str) -> None:
    results = flight.judged(*records)
    assert not is_flown(results)
    assert any(problem in found for found in results[-1].problems)


def test_a_flight_without_end_is_a_fault() -> None:
    flight = Flight().go(9, north=50).say(reached=1).go(9)
    assert "did not end" in flight.judged(record(WpCommand.WAYPOINT, 50.0), ended=False)[-1].problems[0]


def test_turns_are_counted_with_their_sign() -> None:
    flight = Flight().go(9, north=50).say(reached=1, state=FlightPhase.TURN).go(30, turn=-720)
    (result,) = flight.say(state=FlightPhase.DONE).go(5).judged(record(WpCommand.LOITER_TURNS, 50.0, turns=-2))
    assert result.turned_deg == pytest.approx(-720, abs=5)
    assert is_flown([result])


def test_a_landing_far_from_the_descent_is_a_fault() -> None:
    descent = Flight().go(5).say(state=FlightPhase.DESCENT, record=1).go(20, north=9, up=-10)
    assert "landed 8.9 m" in descent.judged(record(WpCommand.LAND), landed=True)[0].problems[0]
    calm = Flight().go(5).say(state=FlightPhase.DESCENT, record=1).go(20, north=2, up=-10)
    assert is_flown(calm.judged(record(WpCommand.LAND), landed=True))


@pytest.mark.parametrize(
    ("north", "crashed", "problem"), [(30.0, False, ""), (75.0, False, "out of bounds"), (10.0, True, "crashed")]
)
def test_a_flyaway_and_a_crash_are_found_whatever_the_board_says(north: float, crashed: bool, problem: str) -> None:
    flight = Flight().go(5, north=north)
    run = MissionRun([HOME, record(WpCommand.WAYPOINT, 30.0)], 0.0, flight.track, flight.reports, has_crashed=crashed)
    found = extremes(run, PLACE)
    assert found.problem == problem
    assert found.farthest_m == pytest.approx(north)
    assert found.off_legs_m == pytest.approx(max(north - 30.0, 0.0), abs=0.1)


def test_the_picture_shows_track_places_and_height() -> None:
    flight = Flight().go(20, north=50)
    records = (HOME, record(WpCommand.WAYPOINT, 50.0), record(WpCommand.SETROI, 20.0))
    picture = ElementTree.fromstring(track_svg(flight.track, records, PLACE, "a <b> & c"))  # noqa: S314
    name = "{http://www.w3.org/2000/svg}"
    assert len(picture.findall(f"{name}circle")) == 3
    assert len(picture.findall(f"{name}polyline")) == 3
    assert picture[0].text == "a <b> & c"
    for line in picture.findall(f"{name}polyline"):
        for point in line.attrib["points"].split():
            x, y = map(float, point.split(","))
            assert 0 <= x <= 640
            assert 0 <= y <= 800
