# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from tests.support.world import GroundStation, World, ready_world


@pytest.fixture
def world() -> World:
    """A world whose board has been found."""
    return ready_world()


@pytest.fixture(scope="module")
def flying() -> tuple[World, GroundStation]:
    """A world whose board has a fix and a home."""
    world = ready_world()
    world.run(7)
    station = GroundStation(world)
    # A new station gets HOME_POSITION within a second: that is not a reply.
    station.stay_connected(wait_s=1.2)
    return world, station
