# SPDX-License-Identifier: GPL-3.0-or-later
"""An armed Harakiri that sends FrSky telemetry and does not hear the bridge: doubtful values are dropped."""

import pytest

from bridge.controllers.harakiri import profile as harakiri
from bridge.fc.frsky_telemetry import FrskyTelemetry
from bridge.model.vehicle import GlobalPosition, Height, Vehicle
from protocols.frsky import FrskyReport
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.board import SimulatedNaze
from tests.support.world import World

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


class SwitchedReceiver(SimulatedNaze):
    """A board whose RX wire can be cut."""

    def __init__(self, options: SimOptions, faults: Faults, *, is_deaf: bool = False) -> None:
        super().__init__(options, faults)
        self.is_deaf = is_deaf

    def receive(self, data: bytes, now: float) -> None:
        if not self.is_deaf:
            super().receive(data, now)


def test_msp_is_used_again_once_the_board_answers_it() -> None:
    faults = Faults()
    board = SwitchedReceiver(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600), faults)
    world = World(faults=faults, peer=board)
    world.wait_ready()
    board.is_deaf, faults.armed = True, True
    world.wait_until(lambda w: w.kind is harakiri.FRSKY, 8)
    board.is_deaf = False
    world.wait_until(lambda w: w.kind is harakiri.PATCHED and w.bridge.session.state.speed == 9600, 8)
    world.assert_line_was_clean()


@pytest.mark.parametrize("after_s", [0.0, 0.3, 0.6, 0.9])
def test_a_deaf_board_is_recognised_by_its_frsky_telemetry(after_s: float) -> None:
    faults = Faults()
    world = World(
        faults=faults, peer=SwitchedReceiver(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600), faults, is_deaf=True)
    )
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 8)
    world.run(after_s)
    faults.armed = True
    world.wait_until(lambda w: w.kind is not harakiri.MAVLINK, 8)
    world.wait_until(lambda w: w.bridge.session.state.controller is not None, 20)
    assert world.kind is harakiri.FRSKY
    world.run(20)
    assert world.kind is harakiri.FRSKY
    assert world.bridge.session.vehicle.fresh(GlobalPosition, world.now) is not None
