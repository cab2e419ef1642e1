# SPDX-License-Identifier: GPL-3.0-or-later
"""A Harakiri is identified over any line, by its own answers."""

import pytest

from bridge.controllers.harakiri import profile as harakiri
from bridge.model.craft import Airframe
from simulator.board.options import Faults, SimOptions
from tests.support.fake_controllers import MspFake, ident
from tests.support.seeds import seeds
from tests.support.world import World


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("rate", [1e-4, 1e-3])
def test_bit_errors_delay_identification_but_never_change_it(rate: float, extension: bool) -> None:
    kind = harakiri.PATCHED if extension else harakiri.UNPATCHED
    found = 0
    for seed in seeds(25):
        faults = Faults(bit_error_rate=rate, extension=extension)
        world = World(SimOptions(seed=seed), faults, speeds=(115200,))
        world.run_until(lambda w: w.kind is not None, 8)
        controller = world.inside.session.state.controller
        if controller is None:
            continue
        found += 1
        assert controller.profile is kind
        assert controller.arm_bit == 5
        assert controller.airframe is Airframe.QUADROTOR
        if controller.info is not None:
            assert (controller.info.capacity, controller.info.wp_radius_cm) == (146, 200)
    assert found >= 22


def test_lost_bytes_delay_identification_but_never_change_it() -> None:
    for seed in seeds(15):
        world = World(SimOptions(seed=seed), Faults(lost_byte_rate=3e-3), speeds=(115200,))
        world.wait_until(lambda w: w.kind is not None, 20)
        assert world.kind is harakiri.PATCHED


def test_the_arm_box_is_found_by_the_name() -> None:
    for boxes in (b"ARM;ANGLE;", b"ANGLE;ARM;HORIZON;", b"ANGLE;HORIZON;ARM"):
        flags = 1 << boxes.split(b";").index(b"ARM")
        status = bytes(6) + flags.to_bytes(4, "little") + b"\0"
        world = World(peer=MspFake({100: ident(241, 0), 2: b"MWII", 116: boxes, 101: status}))
        world.wait_until(lambda w: w.is_found, 3, then_s=1)
        assert world.bridge.vehicle.armed is True
