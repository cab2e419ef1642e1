# SPDX-License-Identifier: GPL-3.0-or-later
"""An armed Harakiri that sends FrSky telemetry and does not hear the bridge: doubtful values are dropped."""

import pytest

from bridge.fc.states.frsky import FrskyTelemetry
from bridge.model.vehicle import GlobalPosition, Height, Vehicle
from protocols.frsky import FrskyReport

HERE = 453838000, 84733000


def vehicle_after(*reports: FrskyReport) -> Vehicle:
    """Receive one report a second."""
    vehicle = Vehicle()
    telemetry = FrskyTelemetry(vehicle)
    for second, report in enumerate(reports):
        telemetry.take(report, float(second))
    return vehicle


def at(north_e7: int, height_m: float | None = None) -> FrskyReport:
    return FrskyReport(height_m, None, None, (HERE[0] + north_e7, HERE[1]))


def test_velocity_and_climb_are_computed_from_two_reports() -> None:
    assert vehicle_after(at(0, 3.0)).last(GlobalPosition) is None
    vehicle = vehicle_after(at(0, 3.0), at(500, 4.5))
    position, height = vehicle.last(GlobalPosition), vehicle.last(Height)
    assert position is not None
    assert height is not None
    assert (position.lat_e7, position.east_m_s) == (HERE[0] + 500, 0)
    assert position.north_m_s == pytest.approx(5.57, abs=0.01)
    assert (position.altitude_m, height.height_m, height.climb_m_s) == (None, 4.5, 1.5)


def test_a_position_that_stops_changing_is_treated_as_a_lost_fix() -> None:
    position = vehicle_after(at(0), at(500), at(500), at(500)).last(GlobalPosition)
    assert position is not None
    assert position.heard_at == 1


@pytest.mark.parametrize("damaged", [at(10_000_000, 8000.0), at(-600_000_000, 60.0)])
def test_a_jump_is_dropped(damaged: FrskyReport) -> None:
    vehicle = vehicle_after(at(0, 2.0), at(300, 3.0), damaged, at(900, 5.0))
    position, height = vehicle.last(GlobalPosition), vehicle.last(Height)
    assert position is not None
    assert height is not None
    assert (position.heard_at, position.lat_e7) == (1, HERE[0] + 300)
    assert (height.heard_at, height.height_m) == (1, 3.0)
