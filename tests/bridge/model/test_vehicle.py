# SPDX-License-Identifier: GPL-3.0-or-later
"""What the bridge believes of a vehicle."""

import pytest

from bridge.model.vehicle import GlobalPosition, Source, Vehicle


@pytest.mark.parametrize("place", [(0, 0), (950_000_000, 84_733_000), (453_838_000, 1_850_000_000)])
def test_an_impossible_fix_is_not_a_position_or_home(place: tuple[int, int]) -> None:
    vehicle = Vehicle()
    vehicle.hear(GlobalPosition(1.0, Source.MSP, *place, 131.0, 0.0, 0.0))
    assert (vehicle.last(GlobalPosition), vehicle.home, vehicle.place()) == (None, None, None)
