# SPDX-License-Identifier: GPL-3.0-or-later
"""A bug in any state of the line starts a new search.

The daemon's part (log the exception, call `Bridge.restart`) is tested in tests/service/daemon/test_daemon.py.
"""

import pytest

from bridge.fc.session import TRANSITIONS
from bridge.fc.states.base import Closed, State
from bridge.fc.states.mavlink import HarakiriMavlink, PassThrough
from bridge.fc.states.mute import Cli, Frsky
from bridge.fc.states.searching import Searching
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.support.fake_controllers import DeafWhileArmed, MavlinkOnly
from tests.support.world import World

ARMED_IN = {HarakiriMavlink: TelemetryProtocol.MAVLINK, Frsky: TelemetryProtocol.FRSKY_9600}


class BugError(Exception):
    """A bug in the bridge itself."""


def world_of(state: type[State]) -> World:
    if state is PassThrough:
        return World(peer=MavlinkOnly())
    faults = Faults()
    board = DeafWhileArmed(SimOptions(tele_prot=ARMED_IN.get(state, TelemetryProtocol.MSP)), faults)
    world = World(faults=faults, peer=board)
    if state in ARMED_IN:
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
