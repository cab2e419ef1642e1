# SPDX-License-Identifier: GPL-3.0-or-later
"""A way in words, and plain limits on it."""

from dataclasses import replace

import pytest

from bridge.controllers.nav.flown_path import fly
from bridge.missions.flown_legs import Departure, FlownPath, Point, beyond_plain_limits, in_metres
from protocols.msp.nav import NavAction, NavRecord

HERE = Point(453838000, 84733000)
#: 100 m to the north.
NORTH = 8983


def leg(hundreds: int, metres: int = 20) -> NavRecord:
    return NavRecord(NavAction.WAYPOINT, HERE.lat_e7 + hundreds * NORTH, HERE.lon_e7, 100 * metres)


def way(*records: NavRecord, lands: bool = False) -> FlownPath:
    return fly(records, Departure(HERE), None, lands=lands)


RTH, AGAIN = NavRecord(NavAction.RTH), NavRecord(NavAction.JUMP, p1=1, p2=3)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (way(leg(1), leg(3, 30)), "300 m, highest 30 m, does not land"),
        (way(leg(1), leg(3), RTH), "600 m, highest 20 m, returns home, does not land"),
        (way(leg(1), leg(3), RTH, lands=True), "600 m, highest 20 m, returns home, lands"),
        (way(leg(1), leg(3), leg(2), AGAIN, leg(4)), "700 m a round, highest 20 m, does not land"),
        (way(leg(1), replace(leg(2), p3=1)), "200 m, does not land"),
        (FlownPath(), "0 m, highest 0 m, does not land"),
    ],
)
def test_a_flight_in_words(path: FlownPath, words: str) -> None:
    assert ", ".join(path.facts()) == words


def test_a_drawing_has_each_leg_once_and_the_landing() -> None:
    path = way(leg(1), leg(3, 30), leg(2), AGAIN, leg(4), RTH, lands=True).shown((1, 2, 3, 4, 5, 6))
    assert [(each.seq, each.length_m, each.end_m, each.is_return) for each in path] == [
        (1, 100.0, 20, False),
        (2, 200.0, 30, False),
        (3, 100.0, 20, False),
        (1, 100.0, 20, False),
        (5, 200.0, 20, False),
        (6, 400.0, None, True),
        (6, 0.0, 0.0, False),
    ]


def test_a_distance_has_the_digits_that_matter() -> None:
    assert [in_metres(metres) for metres in (0.4, 349.2, 5_020.0, 6_751_234.0)] == [
        "0 m",
        "349 m",
        "5.0 km",
        "6,751 km",
    ]


def test_a_way_within_plain_limits_is_not_judged() -> None:
    departure = Departure(HERE)
    assert not beyond_plain_limits(way(leg(19), leg(38), leg(49)), departure)
    (long, far) = beyond_plain_limits(way(leg(10), leg(60)), departure)
    assert (long.place, long.why, far.why) == (1, "5.0 km leg, over 2 km", "6.0 km from the craft, over 5 km")
