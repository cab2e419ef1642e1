# SPDX-License-Identifier: GPL-3.0-or-later
"""Conditions for --where."""

import pytest

from fleet.conditions import matching, parse_condition
from fleet.vehicle import FleetVehicle

KITE = FleetVehicle("kite", "1", answers=True, armed=True, battery_v=11.1, mode="AUTO")
OWL = FleetVehicle("owl", "2", answers=False)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("armed=true", [KITE]),
        ("armed != true", [OWL]),
        ("answers=no", [OWL]),
        ("battery_v<11.2", [KITE]),
        ("battery_v>=11.2", []),
        ("name=k*", [KITE]),
        ("name!=k*", [OWL]),
        ("mode=AUTO", [KITE]),
        ("mode!=AUTO", [OWL]),
        ("bridges=1", [KITE, OWL]),
    ],
)
def test_a_condition_selects_vehicles(text: str, found: list[FleetVehicle]) -> None:
    assert matching([KITE, OWL], [parse_condition(text)]) == found


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("armed", "not a condition"),
        ("colour=red", "no 'colour'"),
        ("armed=maybe", "true or false"),
        ("armed<true", "true or false"),
        ("battery_v=full", "a number"),
        ("name<k", "with = or !="),
        ("session_id=1", "no 'session_id'"),
    ],
)
def test_an_invalid_condition_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        parse_condition(text)
