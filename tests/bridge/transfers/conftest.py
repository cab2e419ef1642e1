# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from tests.support.upload_bench import holding
from tests.support.world import GroundStation, World


@pytest.fixture
def world() -> World:
    """Of a board that holds the old list."""
    return holding()[0]


@pytest.fixture
def station(world: World) -> GroundStation:
    return GroundStation(world)
