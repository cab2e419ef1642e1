# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated INAV flies its mission, and MSP_NAV_STATUS reports it as INAV does."""

import struct
from collections.abc import Callable
from itertools import groupby
from math import hypot

import pytest

from protocols.msp.frame import Direction, MspParser, request
from protocols.msp.inav_places import Corner, FenceAction, Geozone
from protocols.msp.nav import SET_WP_INDEX, NavAction
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import FLAG_HOME, FLAG_LAST, NavWaypoint
from simulator.board.options import Faults
from tests.support.msp_bench import MspBench, set_zone, waypoint

NAV_WP = 1 << 13
NAV, RTH, HOLD, NONE = 3, 2, 1, 0


class Flight:
    """A mission in flight; `seen` has (mode, state, action, number, error) four times a second."""

    def __init__(self, *waypoints: NavWaypoint, version: str = "9.1.0", platform: int = 0) -> None:
        self.bench = MspBench("inav", MspOptions(version=version, platform=platform), faults=Faults(boxes=0))
        self.bench.set("nav_wp_max_safe_distance", 0)
        self.bench.upload(list(waypoints))
        self.bench.faults.armed = True
        self.bench.faults.boxes = NAV_WP
        self.seen: list[tuple[int, ...]] = []

    def status(self) -> tuple[int, ...]:
        return struct.unpack("<5Bh", self.bench.payload(121))[:5]

    def until(self, done: Callable[[tuple[int, ...]], bool], seconds: float = 600.0) -> None:
        end = self.bench.now + seconds
        while not self.seen or not done(self.seen[-1]):
            assert self.bench.now < end, self.seen[-1]
            self.bench.run(0.25)
            self.seen.append(self.status())

    def numbers(self) -> list[int]:
        """The waypoint numbers in the order they were active."""
        return [number for number, _ in groupby(status[3] for status in self.seen)]

    def modes(self) -> set[str]:
        """The names of the modes in MSP_STATUS."""
        flags = struct.unpack_from("<I", self.bench.payload(101), 6)[0]
        names = self.bench.payload(116).decode().split(";")
        return {name for bit, name in enumerate(names[:32]) if flags >> bit & 1}

    def away_from(self, target: NavWaypoint) -> float:
        truth = self.bench.board.truth(self.bench.now)
        assert truth is not None
        north = (truth.flight.lat_e7 - target.lat_e7) / 1e7 * 111320
        east = (truth.flight.lon_e7 - target.lon_e7) / 1e7 * 78200
        return hypot(north, east)


def is_finished(status: tuple[int, ...]) -> bool:
    return status[4] == 4


def test_on_the_ground_the_first_waypoint_is_reported_without_a_mode() -> None:
    bench = MspBench("inav")
    assert bench.payload(121) == bytes((NONE, 0, 0, 1, 0, 0, 0))
    bench.upload([waypoint(1)])
    assert bench.payload(121) == bytes((NONE, 0, 1, 1, 0, 0, 0))


def test_a_craft_stays_at_the_end_of_a_circuit() -> None:
    legs = [waypoint(10), waypoint(20), waypoint(30)]
    flight = Flight(*legs)
    flight.until(is_finished)
    assert flight.numbers() == [1, 2, 3]
    assert flight.seen[-1] == (NAV, 5, 1, 3, 4)
    assert flight.away_from(legs[2]) < 1
    flight.bench.run(30)
    assert flight.away_from(legs[2]) < 1


@pytest.mark.parametrize(("action", "mode"), [(NavAction.WAYPOINT, "NAV WP"), (NavAction.RTH, "NAV RTH")])
def test_during_a_mission_lower_modes_are_reported_too(action: NavAction, mode: str) -> None:
    flight = Flight(waypoint(20), waypoint(40, action))
    flight.until(lambda status: status[3] == 2)
    assert flight.modes() == {"ARM", "ANGLE", mode, "NAV ALTHOLD"}


def test_an_invalid_jump_written_in_flight_crashes_the_board() -> None:
    flight = Flight(waypoint(5), waypoint(9))
    flight.until(is_finished)
    flight.bench.faults.boxes = 0
    flight.bench.run(1)
    flight.bench.write(1, waypoint(5))
    flight.bench.write(2, waypoint(action=NavAction.JUMP, p1=0, p2=1, flag=FLAG_LAST))
    flight.bench.faults.boxes = NAV_WP
    flight.bench.run(30)
    assert flight.bench.board.truth(flight.bench.now) is None
    assert flight.bench.ask(121) is None
    assert flight.bench.board.counters.crashes == 1


@pytest.mark.parametrize(("rth", "last", "state"), [(1, 0, 13), (0, 500, 10)])
def test_the_last_waypoints_p1_decides_on_landing_after_a_return(rth: int, last: int, state: int) -> None:
    flight = Flight(waypoint(10), waypoint(action=NavAction.RTH, p1=rth), waypoint(20, p1=last))
    flight.until(lambda status: status[1] == state)
    assert flight.numbers() == [1, 2]


@pytest.mark.parametrize(("alt_cm", "p3"), [(3000, 0), (16100, 1)])
def test_heights_are_above_home_or_above_sea_level(alt_cm: int, p3: int) -> None:
    flight = Flight(waypoint(100, alt_cm=alt_cm, p3=p3))
    flight.until(is_finished)
    assert struct.unpack_from("<ih", flight.bench.payload(109))[0] == 3000
    assert struct.unpack_from("<h", flight.bench.payload(106), 10)[0] == 161


def test_nose_down_is_a_positive_pitch() -> None:
    flight = Flight(waypoint(100))
    flight.bench.run(5)
    assert struct.unpack("<hhh", flight.bench.payload(108))[1] > 0


def test_the_switch_stops_and_resumes_the_mission_which_disarming_ends() -> None:
    flight = Flight(waypoint(20), waypoint(40), waypoint(60))
    flight.until(lambda status: status[3] == 2)
    flight.bench.faults.boxes = 0
    flight.bench.run(1)
    assert flight.status() == (NONE, 0, 1, 2, 0)
    flight.bench.faults.boxes = NAV_WP
    flight.until(lambda status: status[3] == 3)
    assert flight.numbers() == [1, 2, 3]
    flight.bench.faults.armed = False
    flight.bench.run(1)
    assert flight.status() == (NONE, 0, 1, 1, 0)


@pytest.mark.parametrize("home", [waypoint(30, flag=FLAG_HOME), waypoint(lat_e7=0, lon_e7=0)])
def test_a_leg_without_a_position_or_with_the_home_flag_leads_home(home: NavWaypoint) -> None:
    flight = Flight(waypoint(20), home, waypoint(10))
    flight.until(lambda status: status[3] == 3)
    assert flight.away_from(waypoint(0)) < 5


def test_the_index_is_refused_on_the_ground_outside_of_the_mission_and_beyond_it() -> None:
    """tests/bridge/vehicle/test_set_waypoint.py flies to another waypoint."""
    flight = Flight(waypoint(20), waypoint(40))

    def direction(*index: int) -> Direction:
        flight.bench.send(request(SET_WP_INDEX, bytes(index)))
        (frame,) = MspParser().feed(flight.bench.run(0.05))
        return frame.direction

    assert direction(0) is Direction.ERROR
    flight.until(lambda status: status[:2] == (NAV, 5))
    assert {direction(*index) for index in ((2,), (255,), (), (1, 0))} == {Direction.ERROR}
    assert direction(1) is Direction.REPLY
    flight.bench.faults.boxes = 0
    flight.bench.run(0.5)
    assert direction(0) is Direction.ERROR


ANGLE = 1 << 3
NORTH = 8983


def fenced(action: FenceAction, boxes: int, *, is_inclusive: bool = False, last: float = 5) -> Flight:
    """Legs to the north, 100 m and 100 * last; an exclusive zone 300 m away, or an inclusive one of 300 m."""
    hundreds, radius_cm = (0, 30000) if is_inclusive else (3, 3000)
    zone = Geozone(0, is_inclusive, (Corner(453838000 + hundreds * NORTH, 84733000),), radius_cm, action=action)
    flight = Flight(*(waypoint(20, lat_e7=453838000 + round(at * NORTH), lon_e7=84733000, p1=1000) for at in (1, last)))
    bench = flight.bench
    set_zone(bench.board, zone)
    bench.faults.boxes = boxes
    bench.run(100)
    flight.seen.append(flight.status())
    return flight


@pytest.mark.parametrize(
    ("action", "boxes", "is_inclusive", "mode"),
    [
        (FenceAction.POS_HOLD, NAV_WP | ANGLE, False, HOLD),
        (FenceAction.AVOID, NAV_WP | ANGLE, False, HOLD),
        (FenceAction.POS_HOLD, NAV_WP, False, NAV),
        (FenceAction.NONE, NAV_WP | ANGLE, False, NAV),
        (FenceAction.RTH, NAV_WP | ANGLE, False, RTH),
        (FenceAction.POS_HOLD, NAV_WP | ANGLE, True, HOLD),
        (FenceAction.POS_HOLD, NAV_WP, True, NAV),
    ],
)
def test_a_zone_stops_a_mission_as_on_inavs_own_sitl(
    action: FenceAction, boxes: int, is_inclusive: bool, mode: int
) -> None:
    """tests/real_inav/test_zones.py flies the same."""
    flight = fenced(action, boxes, is_inclusive=is_inclusive)
    assert flight.seen[-1][0] == mode
    if mode == HOLD:
        before = 150 if is_inclusive else 270 - 150
        assert flight.away_from(waypoint(0, lat_e7=453838000 + NORTH * before // 100, lon_e7=84733000)) < 20
        flight.bench.faults.boxes = NAV_WP
        flight.until(is_finished)


@pytest.mark.parametrize(("last", "mode"), [(1.1, NAV), (1.6, HOLD)])
def test_a_zone_past_the_end_of_a_leg_stops_it(last: float, mode: int) -> None:
    """270 m away: INAV looks 150 m ahead on its course."""
    assert fenced(FenceAction.POS_HOLD, NAV_WP | ANGLE, last=last).seen[-1][0] == mode


@pytest.mark.parametrize(
    ("platform", "p1", "seconds", "height_m"),
    [
        (0, 0, 33, 20),
        (0, 20, 33, 20),
        (0, 500, 20, 20),
        (0, 2000, 10, 20),  # up to nav_max_auto_speed
        (1, 500, 33, 20),
        (4, 500, 33, 0),
        (5, 500, 33, 0),
    ],
)
def test_platforms_differ_in_speed_and_height(platform: int, p1: int, seconds: int, height_m: int) -> None:
    flight = Flight(waypoint(20, lat_e7=453838000 + NORTH, lon_e7=84733000, p1=p1), platform=platform)
    flight.bench.faults.boxes = 1 << 13 if platform != 1 else 1 << 12
    flight.until(is_finished)
    truth = flight.bench.board.truth(flight.bench.now)
    assert truth is not None
    assert flight.bench.now == pytest.approx(seconds, abs=1.5)
    assert truth.flight.height_m == pytest.approx(height_m, abs=1)
