# SPDX-License-Identifier: GPL-3.0-or-later
"""A stop during a mission transfer: the new list arrives or the old one stays, and the sender is told which."""

import random

import pytest

from bridge.missions.fc_mission_store import PushFailure
from bridge.model.missions import Outcome, Refusal
from protocols.mission_item import MissionResult
from protocols.msp.frame import MspParser
from protocols.msp.mission import MissionCommand
from simulator.board.options import Faults, SimOptions
from tests.support.conversations import Upload, count_message, records_of, waypoints
from tests.support.world import GroundStation, Radio, World, flash_holding

OLD, NEW = waypoints(20, seed=77), waypoints(146, seed=5)


@pytest.fixture
def world() -> World:
    world = World(SimOptions(boot_ms=500), speeds=(115200,), flash=flash_holding(records_of(OLD)))
    world.wait_ready()
    return world


def stop(world: World) -> None:
    world.bridge.stop_missions(world.now)
    world._flush()


def abort(world: World) -> None:
    world.bridge.abort(world.now)
    world._flush()


def at_rest(world: World) -> bool:
    return not world.bridge.is_busy


def test_a_push_under_way_is_finished(world: World) -> None:
    outcome = world.push(NEW)
    world.run(0.1)
    assert not outcome
    stop(world)
    world.wait_until(at_rest, 1.0)
    assert outcome[0][0].ack is MissionResult.ACCEPTED
    assert world.stored == records_of(NEW)


@pytest.mark.parametrize("seed", range(16))
def test_a_push_may_be_aborted_at_any_moment(world: World, seed: int) -> None:
    """The result is true, and the board accepts the next list."""
    outcome = world.push(NEW)
    world.run(random.Random(seed).uniform(0, 0.45))
    stop(world)
    abort(world)
    took = world.wait_until(at_rest, 1.0)
    result = outcome[0][0]
    if result.ack is MissionResult.ACCEPTED:
        assert world.stored == records_of(NEW)
        assert world.store.outcomes() == [Outcome.VERIFIED]
    elif isinstance(result, Refusal):  # BEGIN was not answered yet
        assert result.text == "naze-bridge is stopping: try again later"
        assert world.stored == records_of(OLD)
    else:
        assert result.text == PushFailure.STOPPED.value.text
        assert world.stored == records_of(OLD)
        assert world.store.outcomes() == [Outcome.FAILED]
        assert took < 0.2
        sent = [frame.command for _, _, data in world.written for frame in MspParser().feed(data)]
        assert MissionCommand.ABORT in sent
    world.assert_line_was_clean()


def test_a_board_that_does_not_answer_keeps_the_old_list() -> None:
    faults = Faults()
    world = World(SimOptions(boot_ms=500), faults, speeds=(115200,), flash=flash_holding(records_of(OLD)))
    world.wait_ready()
    outcome = world.push(NEW)
    world.run(0.1)
    world.power_off()
    world.run(0.05)
    stop(world)
    abort(world)
    # ABORT is not answered either. The daemon waits 0.6 s, then closes the port.
    world.run(0.6)
    world.unplug()
    world.run(0.01)
    assert at_rest(world)
    assert outcome[0][0].ack is MissionResult.DENIED
    assert world.stored == records_of(OLD)
    assert world.store.outcomes() == [Outcome.FAILED]


def test_an_unfinished_upload_is_cancelled_and_stored(world: World) -> None:
    station = GroundStation(world, radio=Radio(delay_s=0.005))
    upload = Upload(station, NEW)
    world.wait_until(lambda _: len(upload.requested) > 20, 5)
    stop(world)
    world.run(0.1)
    assert world.store.outcomes() == [Outcome.CANCELLED]
    # An item already on its way gets the same answer.
    assert {ack.type for ack in station.messages("MISSION_ACK")} == {MissionResult.OPERATION_CANCELLED}
    assert "Upload ended: naze-bridge stops, old mission kept" in station.texts()
    assert world.stored == records_of(OLD)


def test_transfers_are_refused_while_stopping(world: World) -> None:
    station = GroundStation(world)
    stop(world)
    station.send(count_message(5))
    outcome = world.push(NEW)
    world.run(0.1)
    assert [ack.type for ack in station.messages("MISSION_ACK")] == [MissionResult.DENIED]
    assert outcome[0][0].text == "naze-bridge is stopping: try again later"
    assert at_rest(world)
