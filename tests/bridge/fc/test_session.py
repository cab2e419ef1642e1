# SPDX-License-Identifier: GPL-3.0-or-later
"""A bug in any state of the line starts a new search.

The daemon's part (log the exception, call `Bridge.restart`) is tested in tests/service/daemon/test_daemon.py.
"""

import pytest

from bridge.fc.session import TRANSITIONS
from bridge.fc.states.base import Closed, State
from bridge.fc.states.mavlink import HarakiriMavlink, PassThrough
from bridge.fc.states.msp import Cli
from bridge.fc.states.searching import Searching
from simulator.board.options import SimOptions, TelemetryProtocol
from tests.support.fake_controllers import MavlinkOnly
from tests.support.world import World


class BugError(Exception):
    """A bug in the bridge itself."""


def world_of(state: type[State]) -> World:
    if state is PassThrough:
        return World(peer=MavlinkOnly())
    world = World(
        SimOptions(tele_prot=TelemetryProtocol.MAVLINK if state is HarakiriMavlink else TelemetryProtocol.MSP)
    )
    if state is HarakiriMavlink:
        world.wait_ready()
        world.faults.armed = True
    elif state is Cli:
        world.wait_ready()
        world.naze.receive(b"\r\r\r", world.now)
    return world


@pytest.mark.parametrize(
    "state", [state for state in TRANSITIONS if state is not Closed], ids=lambda state: state.__name__
)
def test_a_bug_in_any_state_starts_a_new_search(state: type[State]) -> None:
    world = world_of(state)
    world.wait_until(lambda w: type(w.inside.session.state) is state, 30)
    broken = world.inside.session.state

    def bug(*_args: object) -> None:
        raise BugError

    broken.receive = broken.tick = bug  # type: ignore[assignment,method-assign]
    with pytest.raises(BugError):
        world.run(30)
    world.bridge.restart("internal error", world.now)
    assert isinstance(world.inside.session.state, Searching)
    world.wait_until(lambda w: w.inside.session.state is not broken and type(w.inside.session.state) is state, 30)
