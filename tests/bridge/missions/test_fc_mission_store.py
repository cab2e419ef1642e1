# SPDX-License-Identifier: GPL-3.0-or-later
"""The contract of all mission stores, on every flight controller.

Each store is tested through the whole bridge on its simulated flight controller, for the properties that ground
stations and the Pi's store rely on. How it writes is tested elsewhere.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pytest

from bridge.controllers import multiwii
from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.inav import profile as inav
from bridge.controllers.table import PROFILES
from bridge.missions.fc_mission_store import LIST_IS_GONE, PushFailure
from bridge.missions.list_check import check_list
from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.missions import Outcome, Refusal
from protocols.mission_item import Command, MissionItem, MissionResult
from reports.verdict import Result
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from tests.support.conversations import Download, Upload, clear_message, waypoints
from tests.support.world import GroundStation, World

ACCEPTED, DENIED = MissionResult.ACCEPTED, MissionResult.DENIED
#: MultiWii takes 70 ms per record, a Harakiri in MAVLink mode several seconds for its flash.
TIMEOUT_S, TRIES = 60.0, 100


@dataclass(frozen=True)
class Craft:
    """A flight controller and its world. `radius_m`: a hit radius that it stores unchanged."""

    world: World
    station: GroundStation
    faults: Faults
    radius_m: float

    def plan(self, count: int, seed: int = 0) -> list[MissionItem]:
        """A list that it stores without a finding, apart from positions in single precision."""
        items = waypoints(count, seed)
        return [replace(item, p2=self.radius_m, lon_e7=(item.lon_e7 or 0) - 91 * item.seq) for item in items]

    def upload(self, items: Sequence[MissionItem]) -> MissionResult | None:
        return Upload(self.station, items, tries=TRIES).run(TIMEOUT_S)

    def download(self) -> list[MissionItem]:
        return Download(self.station).run(TIMEOUT_S)

    def pull(self) -> HeldMission:
        held = self.world.pull()
        assert isinstance(held, HeldMission), held
        return held

    def holds(self, items: Sequence[MissionItem]) -> bool:
        """True if it reads back as that list; home may be its own, and positions 0.4 m off."""
        read = self.download()
        return len(read) == len(items) and all(map(is_alike, read[1:], items[1:]))

    def arm(self) -> None:
        self.world.arm(30)


def is_alike(one: MissionItem, other: MissionItem) -> bool:
    near = abs((one.lat_e7 or 0) - (other.lat_e7 or 0)) <= 40 and abs((one.lon_e7 or 0) - (other.lon_e7 or 0)) <= 40
    return near and replace(one, lat_e7=other.lat_e7, lon_e7=other.lon_e7) == other


def patched_harakiri() -> Craft:
    faults = Faults()
    world = World(faults=faults, speeds=(115200,))
    return Craft(world, GroundStation(world), faults, 2.0)


def board(kind: str) -> Craft:
    faults = Faults(boxes=0)
    world = World(peer=make_board(kind, faults=faults), speeds=(115200,))
    return Craft(world, GroundStation(world), faults, 0.0)


MAKERS: dict[str, Callable[[], Craft]] = {
    harakiri.PATCHED.name: patched_harakiri,
    inav.PROFILE.name: lambda: board("inav"),
    multiwii.PROFILE.name: lambda: board("multiwii"),
}


def test_every_mission_store_is_tested() -> None:
    """A Harakiri in MAVLink mode is armed, and takes none."""
    storing = (profile for profile in PROFILES if not isinstance(profile.missions, Refusal))
    assert MAKERS.keys() == {profile.name for profile in storing} - {harakiri.MAVLINK.name}


def assert_is_true(
    craft: Craft, delivery: DeliveryResult, old: Sequence[MissionItem], new: Sequence[MissionItem]
) -> None:
    """The reported outcome of an interrupted push is true. UNCERTAIN promises nothing."""
    if delivery.ack is ACCEPTED:
        assert craft.holds(new)
    elif delivery.text not in {failure.value.text for failure in LIST_IS_GONE}:
        assert craft.holds(old)
    elif delivery.text != PushFailure.UNCERTAIN.value.text:
        # An INAV loads its saved mission again, and the pilot is told.
        assert len(craft.download()) <= 1 or craft.holds(old)


@pytest.fixture(params=MAKERS)
def craft(request: pytest.FixtureRequest) -> Craft:
    made = MAKERS[request.param]()
    made.world.wait_until(lambda w: w.kind is not None and w.kind.name == request.param, 20)
    made.world.wait_until(lambda w: w.bridge.vehicle.armed is False and not w.bridge.is_busy, 20, then_s=1)
    return made


def test_an_accepted_list_is_stored_and_read_back_by_all(craft: Craft) -> None:
    sent = craft.plan(25)
    assert craft.upload(sent) is ACCEPTED
    assert craft.world.store.outcomes() == [Outcome.VERIFIED]
    assert craft.holds(sent)
    held = craft.pull()
    assert held.identity.count == len(held.records)
    assert all(isinstance(record.pack(), bytes) for record in held.records)
    assert [item.seq for item in held.items] == list(range(25))
    another = GroundStation(craft.world, "other", sysid=254)
    assert Download(another).run(TIMEOUT_S) == craft.download()


def test_writing_a_read_list_again_keeps_the_records(craft: Craft) -> None:
    assert craft.upload(craft.plan(12)) is ACCEPTED
    before = craft.pull()
    assert craft.upload(craft.download()) is ACCEPTED
    assert craft.world.store.missions[-1][0].verdict.findings == ()
    after = craft.pull()
    assert (after.records, after.items[1:]) == (before.records, before.items[1:])


def test_a_new_list_replaces_the_old_list(craft: Craft) -> None:
    for count, seed in ((20, 1), (5, 2), (9, 3)):
        assert craft.upload(craft.plan(count, seed)) is ACCEPTED
        assert craft.holds(craft.plan(count, seed))


def test_a_cleared_list_reads_as_empty_and_can_be_replaced(craft: Craft) -> None:
    assert craft.upload(craft.plan(6)) is ACCEPTED
    craft.station.send(clear_message(), wait_s=6)
    assert craft.world.store.outcomes()[-1] is Outcome.VERIFIED
    assert len(craft.download()) <= 1
    assert (craft.pull().records, craft.pull().items) == ((), ())
    assert craft.upload(craft.plan(7)) is ACCEPTED
    assert craft.holds(craft.plan(7))


def test_a_rejected_list_keeps_the_mission_and_has_a_reason(craft: Craft) -> None:
    assert craft.upload(craft.plan(6)) is ACCEPTED
    good = craft.plan(6, 1)
    for bad in (
        good[:1],
        [replace(good[0], command=Command.NAV_LAND), *good[1:]],
        [*good[:3], replace(good[3], frame=7)],
        [*good[:3], replace(good[3], lat_e7=900_000_001)],
        craft.plan(250, 1),
        [good[0], replace(good[1], command=Command.NAV_RETURN_TO_LAUNCH, lat_e7=0, lon_e7=0)],
    ):
        craft.station.take()
        assert craft.upload(bad) not in (None, ACCEPTED)
        assert craft.station.texts()
        craft.world.run(2)
    assert craft.holds(craft.plan(6))


def test_item_by_item_and_whole_list_checks_agree(craft: Craft) -> None:
    found: list[Any] = []
    craft.world.inside.runner.start(
        craft.world.inside.missions.preflight(), lambda report, _: found.append(report), craft.world.now
    )
    craft.world.wait_until(lambda _: bool(found), 10)
    rules = found[0].rules
    good = craft.plan(4)
    odd = [replace(good[1], command=command) for command in (*Command, 206)]
    for middle in itertools.chain.from_iterable(([one], [one, other]) for one in odd for other in odd[:3]):
        items = [good[0], good[1], *middle, good[2]]
        whole = check_list(items, rules)
        check = rules.begin(len(items), None)
        rejections = [check.take(item) for item in items]
        assert check.finish() == whole
        if any(rejections):
            assert whole.result is Result.REJECTED
        if whole.result is Result.ACCEPTED:
            assert whole.items[0].seq == 0
            assert [item.seq for item in whole.items] == list(range(len(whole.items)))


def test_does_not_send_to_an_armed_craft(craft: Craft) -> None:
    assert craft.upload(craft.plan(6)) is ACCEPTED
    craft.arm()
    assert craft.upload(craft.plan(8, 1)) is DENIED
    craft.station.send(clear_message(), wait_s=3)
    assert any("isarm" in text for text in craft.station.texts())
    craft.faults.armed = False
    craft.world.wait_until(lambda w: w.bridge.vehicle.armed is False, 30, then_s=3)
    assert craft.holds(craft.plan(6))


@pytest.mark.parametrize("craft", [multiwii.PROFILE.name], indirect=True)
def test_an_armed_craft_is_not_asked_for_the_list(craft: Craft) -> None:
    craft.arm()
    craft.world.inside.missions.held = None
    answer = craft.world.pull()
    assert isinstance(answer, Refusal)
    assert "Armed" in answer.text


@pytest.mark.parametrize("moment", [0.05, 0.6])
def test_a_push_that_loses_the_line_ends_with_a_true_result(craft: Craft, moment: float) -> None:
    assert craft.upload(craft.plan(6)) is ACCEPTED
    outcome = craft.world.push(craft.plan(60, 1))
    craft.world.run(moment)
    craft.world.unplug()
    craft.world.wait_until(lambda _: bool(outcome), 10)
    delivery, _ = outcome[0]
    craft.world.plug()
    craft.world.wait_until(lambda w: w.is_found and w.bridge.vehicle.armed is False, 20, then_s=8)
    assert_is_true(craft, delivery, craft.plan(6), craft.plan(60, 1))


@pytest.mark.parametrize("moment", [0.05, 0.6])
def test_a_push_that_is_stopped_ends_with_a_true_result(craft: Craft, moment: float) -> None:
    assert craft.upload(craft.plan(6)) is ACCEPTED
    outcome = craft.world.push(craft.plan(100, 1))
    craft.world.run(moment)
    craft.world.bridge.abort(craft.world.now)
    craft.world.wait_until(lambda _: bool(outcome), 10)
    delivery, _ = outcome[0]
    craft.world.run(4)
    assert_is_true(craft, delivery, craft.plan(6), craft.plan(100, 1))
