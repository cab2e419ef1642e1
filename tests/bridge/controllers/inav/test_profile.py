# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV and MultiWii are recognised by their answers."""

from collections.abc import Callable

import pytest

from bridge.controllers import multiwii
from bridge.controllers.inav import profile as inav
from bridge.fc.profile import Profile
from tests.bridge.controllers.nav.test_mission_store import found
from tests.support.fake_inav import FakeInav, FakeMultiwii


@pytest.mark.parametrize(
    ("make", "kind", "capacity"), [(FakeInav, inav.PROFILE, 120), (FakeMultiwii, multiwii.PROFILE, 60)]
)
def test_the_board_is_recognised_by_the_answers(make: Callable[[], FakeInav], kind: Profile, capacity: int) -> None:
    world, _ = found(make())
    assert world.kind is kind
    assert world.inside.session.state.controller is not None
    assert world.inside.session.state.controller.capacity == capacity
    assert world.bridge.vehicle.armed is False
