# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions to INAV and MultiWii NAV through the whole bridge: verification, faults, arming, clearing, progress."""

import random
import struct
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import pytest

from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from bridge.model.missions import Outcome
from protocols.mission_item import MissionItem, MissionResult
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.nav import LAST, Nav, NavAction
from reports.vehicle_groups import Group
from tests.support.conversations import Download, Upload, count_message, waypoints
from tests.support.fake_inav import FakeInav, FakeMultiwii, lossy
from tests.support.seeds import seeds
from tests.support.world import GroundStation, Radio, World, ready_world

FakeT = TypeVar("FakeT", bound=FakeInav)
RULES = NavRules(NavProfile())
ACCEPTED, DENIED = MissionResult.ACCEPTED, MissionResult.DENIED
CLEARED = bytes((NavAction.RTH, *bytes(18), LAST))


def plan(count: int, seed: int = 0) -> list[MissionItem]:
    """Waypoints that INAV stores unchanged, further apart than its nav_wp_radius."""
    home, *legs = waypoints(count, seed)
    # The fake's own home, so that it reads back as sent.
    home = replace(home, lat_e7=453838000, lon_e7=84733000)
    return [replace(item, p2=0.0, lon_e7=(item.lon_e7 or 0) - 91 * item.seq) for item in (home, *legs)]


def packed(items: list[MissionItem]) -> list[bytes]:
    return [record.pack() for record in check_list(items, RULES).records]


def found(peer: FakeInav) -> tuple[World, GroundStation]:
    world = ready_world(peer=peer, within_s=5)
    return world, GroundStation(world)


def fresh(make: type[FakeT]) -> tuple[FakeT, World, GroundStation]:
    """A board that holds no mission, and its world."""
    board = make()
    return board, *found(board)


def test_a_written_list_is_saved_and_reads_as_sent() -> None:
    inav, world, station = fresh(FakeInav)
    sent = plan(121)
    assert Upload(station, sent).run() is ACCEPTED
    assert inav.saved == inav.records == packed(sent)
    assert world.store.outcomes() == [Outcome.VERIFIED]
    assert world.store.missions[0][0].verdict.findings == ()
    assert Download(station).run() == sent
    assert inav.writes == 120
    assert inav.saves == 1


def test_each_record_is_read_before_the_next_is_sent() -> None:
    _, station = found(FakeInav())
    assert Upload(station, plan(30)).run() is ACCEPTED
    mission = [f for f in station.world.requests() if f.command in (Nav.SET_WP, Nav.WP) and f.payload[0] != 0]
    written = [n for n, f in enumerate(mission) if f.command == Nav.SET_WP]
    assert [mission[n].payload[0] for n in written] == list(range(1, 30))
    for n in written:
        assert (mission[n + 1].command, mission[n + 1].payload[0]) == (Nav.WP, mission[n].payload[0])


def test_a_record_that_is_not_stored_is_noticed_and_the_old_list_restored() -> None:
    inav, world, station = fresh(FakeInav)
    old = plan(12)
    assert Upload(station, old).run() is ACCEPTED
    place = packed(plan(40, 3))[30][1:9]
    inav.ignores = lambda record: record[1:9] == place
    assert Upload(station, plan(40, 3)).run() is MissionResult.INVALID
    assert inav.records == packed(old)
    assert (inav.is_valid, inav.saves) == (True, 1)
    assert Download(station).run() == old
    assert "refused an item" in world.store.missions[-1][1].detail  # type: ignore[union-attr]


@pytest.mark.parametrize("first", ["a refused record", "an arming"])
def test_after_a_failed_upload_the_next_failure_restores_the_old_list_too(first: str) -> None:
    """A MultiWii's list is not read again after a failure, so the bridge must remember it."""
    board, world, station = fresh(FakeMultiwii)
    old = plan(12)
    assert Upload(station, old).run() is ACCEPTED
    if first == "an arming":
        upload = Upload(GroundStation(world, "far", radio=Radio(delay_s=0.02)), plan(10, 1))
        world.run_until(lambda _: len(upload.requested) == 10, 5)
        board.armed = True
        assert upload.run() is DENIED
        board.armed = False
        world.run(3)
    board.ignores = lambda record: record in packed(plan(12, 2))[5:]
    for _ in range(2):
        assert Upload(station, plan(12, 2)).run() is MissionResult.INVALID
        assert board.flown == packed(old)
        world.run(5)


def test_half_a_list_on_an_empty_board_cannot_be_flown() -> None:
    inav = FakeInav(drop=lambda frame: "request" if frame.command == Nav.SET_WP and frame.payload[0] == 20 else "")
    world, station = found(inav)
    assert Upload(station, plan(40)).run() is DENIED
    assert (len(inav.records), inav.is_valid, inav.saved) == (19, False, None)
    assert "no mission on board" in world.store.missions[-1][1].detail  # type: ignore[union-attr]
    assert Download(station).run()[1:] == []


@pytest.mark.parametrize("make", [FakeInav, FakeMultiwii])
def test_losses_only_delay_the_upload(make: Callable[[], FakeInav]) -> None:
    for seed in seeds(2):
        peer = make()
        peer.drop = lossy(0.05, seed)
        _, station = found(peer)
        assert Upload(station, plan(30, seed), tries=40).run() is ACCEPTED
        peer.drop = lambda _frame: ""
        assert Download(station).run() == plan(30, seed)


@pytest.mark.parametrize("loss", ["request", "reply"])
def test_one_lost_frame_costs_less_than_two_seconds(loss: str) -> None:
    """The longest is SAVE's: a second, in which a board may write its flash."""
    inav, world, _ = fresh(FakeInav)
    draw = random.Random(5)
    for seed in seeds(8):
        lost = draw.choice((Nav.SET_WP, Nav.WP, Nav.GETINFO, Nav.SAVE))
        left = draw.randrange(1, 30) if lost in (Nav.SET_WP, Nav.WP) else 1

        def drop(frame: MspFrame, command: int = lost) -> str:
            nonlocal left
            left -= frame.command == command
            return loss if frame.command == command and left == 0 else ""

        inav.drop = drop
        outcome = world.push(plan(31, seed))
        world.run(2.0)
        assert outcome[0][0].ack is ACCEPTED


def test_the_arming_state_is_read_before_a_transfer() -> None:
    inav, world, _ = fresh(FakeInav)
    upload = Upload(GroundStation(world, "far", radio=Radio(delay_s=0.02)), plan(10))
    world.run_until(lambda _: len(upload.requested) == 10, 5)
    inav.armed = True
    assert world.bridge.vehicle.armed is False
    assert upload.run() is DENIED
    assert inav.writes == 0


def test_after_arming_during_a_transfer_the_last_record_is_not_sent() -> None:
    inav, world, station = fresh(FakeInav)
    assert Upload(station, plan(10)).run() is ACCEPTED
    upload = Upload(station, plan(60, 1))
    honest = inav.store

    def store(number: int, record: bytes) -> None:
        honest(number, record)
        inav.armed = number >= 30

    inav.store = store  # type: ignore[method-assign]
    assert upload.run() is DENIED
    assert not inav.is_valid
    assert len(inav.records) < 59
    assert any("Armed while writing" in text for text in station.texts())
    assert world.bridge.missions.held is None


def test_a_save_that_fails_is_reported() -> None:
    inav, world, station = fresh(FakeInav)
    inav.save = lambda: None  # type: ignore[method-assign]
    assert Upload(station, plan(10)).run() is DENIED
    assert "not saved" in world.store.missions[-1][1].detail  # type: ignore[union-attr]
    assert inav.is_valid


def test_a_cleared_list_is_one_return_home_and_reads_as_empty() -> None:
    for board in (FakeInav(), FakeMultiwii()):
        _world, station = found(board)
        assert Upload(station, plan(10)).run() is ACCEPTED
        station.send(count_message(0), wait_s=3)
        assert (board.flown if isinstance(board, FakeMultiwii) else board.saved) == [CLEARED]
        download = Download(station)
        assert download.run()[1:] == []
        assert download.count == 1  # home
        other, other_station = found(board)
        assert other.bridge.missions.held is not None
        assert Download(other_station).run()[1:] == []


def test_a_link_lost_during_a_transfer_is_reported_and_the_next_upload_works() -> None:
    inav, world, station = fresh(FakeInav)
    upload = Upload(station, plan(60))
    world.run_until(lambda _: len(inav.records) == 25, 5)
    world.unplug()
    assert upload.run() is DENIED
    assert not inav.is_valid
    world.plug()
    world.wait_ready(10)
    assert Upload(station, plan(60)).run() is ACCEPTED


def test_a_frame_that_may_have_lost_the_header_is_followed_by_a_harmless_request() -> None:
    """INAV opens its CLI on a '#' outside a frame followed by 100 ms of silence, and then no longer answers MSP."""
    for lost in (1, 6, 11):
        inav = FakeInav()
        world, station = found(inav)
        seen = 0

        def drop(frame: MspFrame) -> str:
            nonlocal seen
            seen += frame.command == Nav.SET_WP
            return "request" if frame.command == Nav.SET_WP and seen == lost else ""  # noqa: B023

        inav.drop = drop
        sent = plan(12)
        sent[1:] = [MissionItem(i.seq, 16, 3, 0, 0, 0, 0, 0x23232323, 0x52525252, 35.0) for i in sent[1:]]
        assert Upload(station, sent).run() is ACCEPTED
        moments = [at for at, _, _ in world.written]
        risky = [at for at, _, data in world.written if set(data) & {0x23, 0x52} and data[4] == Nav.SET_WP]
        assert risky
        assert all(any(at < later < at + 0.1 for later in moments) for at in risky)


def test_a_reply_for_home_is_not_mistaken_for_a_written_record() -> None:
    """Telemetry reads home with the same command."""
    inav, world, station = fresh(FakeInav)
    upload = Upload(station, plan(40))
    home = MspFrame(Direction.REPLY, Nav.WP, b"\0" + inav.read(0)).encode()
    while not upload.is_over:
        world.run(0.005)
        world.receive_from_fc(home)
    assert upload.result is ACCEPTED
    assert inav.writes == 39


def test_a_crashing_record_is_not_written_back() -> None:
    """Another program left a JUMP to 0; the next push fails, and the old list cannot be restored."""
    inav = FakeInav()
    waypoint, *_ = packed(plan(3))
    jump = bytes((NavAction.JUMP, *bytes(18), 0))
    inav.records, inav.is_valid = [waypoint, jump, waypoint[:-1] + bytes((LAST,))], True
    world, station = found(inav)
    inav.drop = lambda frame: "request" if frame.command == Nav.SET_WP and frame.payload[0] == 5 else ""
    assert Upload(station, plan(10)).run() is DENIED
    assert "no mission on board" in world.store.missions[-1][1].detail  # type: ignore[union-attr]
    inav.drop = lambda _frame: ""
    assert Upload(station, plan(10)).run() is ACCEPTED


def test_a_list_replaced_by_another_program_is_not_restored() -> None:
    inav, world, station = fresh(FakeInav)
    assert Upload(station, plan(12)).run() is ACCEPTED
    inav.records = [*packed(plan(5))]
    inav.drop = lambda frame: "request" if frame.command == Nav.SET_WP and frame.payload[0] == 3 else ""
    assert Upload(station, plan(10, 1)).run() is DENIED
    assert not inav.is_valid
    assert "no mission on board" in world.store.missions[-1][1].detail  # type: ignore[union-attr]


def test_a_save_whose_reply_is_lost_is_repeated() -> None:
    lost = iter(("reply",))
    inav = FakeInav(drop=lambda frame: next(lost, "") if frame.command == Nav.SAVE else "")
    _, station = found(inav)
    assert Upload(station, plan(10)).run() is ACCEPTED
    assert inav.saves == 2


def test_if_the_first_record_is_lost_the_old_list_is_reported_kept() -> None:
    inav, world, station = fresh(FakeInav)
    assert Upload(station, plan(12)).run() is ACCEPTED
    inav.drop = lambda frame: "request" if frame.command == Nav.SET_WP else ""
    assert Upload(station, plan(10, 1)).run() is DENIED
    assert "old mission kept" in world.store.missions[-1][1].detail  # type: ignore[union-attr]
    assert inav.records == packed(plan(12))
    inav.drop = lambda _frame: ""
    assert Download(station).run()[1:] == plan(12)[1:]


def test_multiwii_reports_the_current_in_tenths_of_an_ampere() -> None:
    """Protocol.cpp, types.h: analog.amperage."""
    board = FakeMultiwii()
    board.answers = {**board.answers, 110: struct.pack("<BHHH", 120, 500, 0, 125)}
    world, _ = found(board)
    world.run(2)
    battery = world.bridge.group(Group.BATTERY, world.now)
    assert (battery.current_a, battery.drawn_mah) == (12.5, 500)
