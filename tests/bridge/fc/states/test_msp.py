# SPDX-License-Identifier: GPL-3.0-or-later
"""A board that answers MSP is followed into and out of every protocol it may arm to."""

import random

import pytest

from bridge.controllers.harakiri import profile as harakiri
from simulator.board.options import Faults, SimOptions
from tests.bridge.fc.states.test_searching import ALL_SPEEDS, verdict
from tests.support.seeds import seeds
from tests.support.world import World


@pytest.mark.parametrize("extension", [True, False])
@pytest.mark.parametrize("baud", ALL_SPEEDS)
def test_a_board_is_found_within_3_s_of_booting_after_any_power_cycle(baud: int, extension: bool) -> None:
    draw = random.Random(baud)
    for _ in range(2):
        boot_s = draw.choice((0.5, 1.0, 2.0, 3.5))
        world = World(SimOptions(baud=baud, boot_ms=boot_s * 1000), Faults(extension=extension))
        world.wait_until(verdict, 10, then_s=draw.random() * draw.choice((0.2, 4)))
        world.power_off()
        world.run(draw.choice((0.001, draw.random() * 3, draw.random() * 12)))
        world.power_on()
        world.run(boot_s)
        began = world.now

        def answers(world: World, began: float = began) -> bool:
            link = world.inside.session.state.link
            return link is not None and link.last_heard_at > began

        assert world.wait_until(answers, 20) <= 3
        world.wait_ready()
        world.assert_line_was_clean()


def test_the_board_is_found_after_random_power_and_port_losses() -> None:
    for seed in seeds(5):
        world = World(SimOptions(boot_ms=800), seed=seed)
        draw = random.Random(seed)
        plugged = powered = True
        for _ in range(12):
            world.run(draw.random() * draw.choice((0.05, 0.5, 3)))
            match draw.randrange(4):
                case 0:
                    world.unplug() if plugged else world.plug()
                    plugged = not plugged
                case 1:
                    world.power_off() if powered else world.power_on()
                    powered = not powered
                case 2:
                    world.faults.hang = not world.faults.hang
                case _:
                    world.push([])
        world.faults.hang = False
        if not plugged:
            world.plug()
        if not powered:
            world.power_on()
        world.run(0.8)
        # Time to notice that the board was lost.
        world.run(2.0)
        world.wait_until(lambda w: w.kind is harakiri.PATCHED, 3)
