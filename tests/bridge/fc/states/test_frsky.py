# SPDX-License-Identifier: GPL-3.0-or-later
"""A deaf Harakiri is recognised by its FrSky telemetry, and asked over MSP once it answers again."""

import pytest

from bridge.controllers.harakiri import profile as harakiri
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.board import SimulatedNaze
from tests.support.world import World


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
    world.wait_until(lambda w: w.kind is harakiri.PATCHED and w.inside.session.state.speed == 9600, 8)
    world.assert_line_was_clean()


@pytest.mark.parametrize("after_s", [0.0, 0.3, 0.6, 0.9])
def test_a_deaf_board_is_recognised_by_the_frsky_telemetry(after_s: float) -> None:
    faults = Faults()
    world = World(
        faults=faults, peer=SwitchedReceiver(SimOptions(tele_prot=TelemetryProtocol.FRSKY_9600), faults, is_deaf=True)
    )
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK, 8)
    world.run(after_s)
    faults.armed = True
    world.wait_until(lambda w: w.kind is not harakiri.MAVLINK, 8)
    world.wait_until(lambda w: w.inside.session.state.controller is not None, 20)
    assert world.kind is harakiri.FRSKY
    world.run(20)
    assert world.kind is harakiri.FRSKY
    assert world.bridge.vehicle.armed
