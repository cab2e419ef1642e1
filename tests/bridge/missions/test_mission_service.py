# SPDX-License-Identifier: GPL-3.0-or-later
"""After a push with an unknown outcome the board is asked once it is back, and the pilot is told."""

import pytest

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.fc_mission_store import PushFailure
from bridge.missions.list_check import check_list
from bridge.model.missions import ArrivedMission, Outcome
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.mission import MissionCommand
from simulator.board.options import SimOptions
from tests.support.conversations import Upload, ack_message, records_of, waypoints
from tests.support.world import GroundStation, World, flash_holding, ready_world

OLD, NEW = waypoints(20, seed=77), waypoints(30)
OLD_FLASH = flash_holding(records_of(OLD))
ARRIVED = "The mission did arrive: 30 records"
KEPT = "Mission did not arrive: write it again"


def is_committing(world: World) -> bool:
    return any(frame.command == MissionCommand.COMMIT for frame in world.requests())


@pytest.mark.parametrize("boot_ms", [7100, 25200])
@pytest.mark.parametrize(("cut_after_s", "outcome"), [(0.0, Outcome.FAILED), (0.003, Outcome.VERIFIED)])
def test_a_board_that_resets_during_commit_is_asked_later(boot_ms: int, cut_after_s: float, outcome: Outcome) -> None:
    """7.1 s from reset to the first reply, 25.2 s without its GPS module."""
    world = ready_world(SimOptions(boot_ms=boot_ms), flash=OLD_FLASH)
    station = GroundStation(world)
    upload = Upload(station, NEW)
    world.wait_until(is_committing, 5, then_s=cut_after_s)
    upload.stop()
    station.radio.loss = 0.0
    if outcome is Outcome.VERIFIED:
        # Stored, but the reply is lost.
        world.unplug()
    world.power_off()
    world.wait_until(lambda _: bool(station.messages("MISSION_ACK")), 20)
    assert [message.type for message in station.messages("MISSION_ACK")] == [MissionResult.DENIED]
    assert PushFailure.UNCERTAIN.value.text in station.texts()
    assert world.store.outcomes() == [None]
    station.take()
    world.power_on()
    if outcome is Outcome.VERIFIED:
        world.plug()
    world.wait_ready(boot_ms / 1000 + 15, then_s=1)
    assert world.stored == records_of(NEW if outcome is Outcome.VERIFIED else OLD)
    assert (ARRIVED if outcome is Outcome.VERIFIED else KEPT) in " ".join(station.texts())
    assert world.store.outcomes() == [outcome]


@pytest.mark.parametrize(("items", "outcome"), [(OLD, Outcome.VERIFIED), (NEW, Outcome.FAILED)])
def test_a_mission_that_a_killed_daemon_left_pending_is_settled_at_the_start(
    items: list[MissionItem], outcome: Outcome
) -> None:
    world = World(speeds=(115200,), flash=OLD_FLASH)
    verdict = check_list(items, HarakiriRules())
    world.store.missions.append((ArrivedMission("udp", tuple(items), verdict), None))
    world.wait_ready(then_s=1)
    assert world.store.outcomes() == [outcome]


def test_other_stations_hear_only_of_new_lists() -> None:
    """A station that timed out may write the same list again."""
    world = ready_world(flash=OLD_FLASH)
    station, other = GroundStation(world), GroundStation(world, "other", sysid=254)
    other.send(ack_message(MissionResult.ACCEPTED))
    heard: list[list[str]] = []
    for items in (OLD, NEW, NEW, []):
        other.take()
        assert Upload(station, items).run() is MissionResult.ACCEPTED
        world.run(1)
        heard.append(other.texts())
    assert heard == [[], ["New mission, 30 items, by gcs"], [], ["Mission erased by gcs"]]
