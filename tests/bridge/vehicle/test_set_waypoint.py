# SPDX-License-Identifier: GPL-3.0-or-later
"""Set WP on the simulated INAV: the one request of a ground station that changes a flight."""

from collections.abc import Sequence
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.gcs.rights import LinkAccess
from bridge.model.vehicle import MissionLeg
from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.frame import MspFrame
from protocols.msp.nav import FINISHED, Nav, NavState, NavStatus
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board
from simulator.inav.boxes import BOXES
from tests.support.conversations import Download, Upload
from tests.support.fake_inav import FAKE, FakeInav
from tests.support.world import GroundStation, World, ready_world

ACCEPTED, DENIED, FAILED = 0, 2, 4
SET_CURRENT = m.MAV_CMD_DO_SET_MISSION_CURRENT
NAV_WP = 1 << BOXES["9.1.0"].index(28)
HOME_E7 = (453838000, 84733000)


def leg(north_m: int, command: int = Command.NAV_WAYPOINT, alt_m: float = 10.0) -> MissionItem:
    return MissionItem(0, command, 3, 0, 0, 0, 0, HOME_E7[0] + north_m * 90, HOME_E7[1], alt_m)


def order(command: int, p1: float = 0.0, p2: float = 0.0) -> MissionItem:
    return MissionItem(0, command, 3, p1, p2, 0, 0, 0, 0, 0)


#: Read back as sent.
MISSION = [
    MissionItem(0, Command.NAV_WAYPOINT, 0, 0, 0, 0, 0, *HOME_E7, 120.0),
    leg(60),
    leg(30, Command.DO_SET_ROI),
    leg(120),
    order(Command.DO_JUMP, 1, 1),
    order(Command.DO_CHANGE_SPEED, 1, 5.0),
    leg(180),
    leg(240),
    order(Command.NAV_RETURN_TO_LAUNCH),
]


#: An open link steers nothing.
LINKS = {"udp": LinkAccess(may_write=lambda _peer: True)}


class Flight:
    """A simulated INAV that flies MISSION, to its first leg."""

    def __init__(self, items: Sequence[MissionItem] = MISSION, *, links: Any = None, **options: Any) -> None:
        self.board: MspBoard = make_board("inav", MspOptions(**options), Faults(boxes=0))
        self.world = ready_world(peer=self.board, links=LINKS if links is None else links, within_s=10)
        self.world.run(2)
        self.station = GroundStation(self.world)
        if links is None:
            assert Upload(self.station, list(items)).run() is MissionResult.ACCEPTED

    def begin(self) -> "Flight":
        self.world.arm(then_s=2)
        self.board.faults.boxes = NAV_WP
        self.world.run(2)
        self.station.received.clear()
        return self

    def ask(self, message: Message, station: GroundStation | None = None, seconds: float = 0.5) -> None:
        (station or self.station).send(message)
        self.world.run(seconds)

    @property
    def status(self) -> NavStatus:
        leg = self.world.bridge.vehicle.last(MissionLeg)
        assert leg is not None
        assert isinstance(leg.report, NavStatus)
        return leg.report

    @property
    def number(self) -> int:
        """The record that the board flies to."""
        return self.status.number

    @property
    def has_finished(self) -> bool:
        return self.status.error == FINISHED

    def sent(self) -> list[MspFrame]:
        return [frame for frame in self.world.requests() if frame.command == 0x2221]

    def current(self, station: GroundStation | None = None) -> list[int]:
        return [message.seq for message in (station or self.station).messages("MISSION_CURRENT")]


def set_current(seq: int) -> Message:
    return m.MAVLink_mission_set_current_message(1, 1, seq)


def long(seq: float, resets: float = 0.0) -> Message:
    return m.MAVLink_command_long_message(1, 1, SET_CURRENT, 0, seq, resets, 0, 0, 0, 0, 0)


def results(station: GroundStation) -> list[int]:
    return [ack.result for ack in station.messages("COMMAND_ACK") if ack.command == SET_CURRENT]


@pytest.fixture
def flight() -> Flight:
    return Flight().begin()


def test_the_craft_flies_to_the_item_and_continues(flight: Flight) -> None:
    other = GroundStation(flight.world, "other", sysid=254).stay_connected(wait_s=1)
    flight.station.received.clear()
    flight.ask(set_current(3))
    assert flight.number == 3
    assert flight.current()[0] == 3, "at once, and no older one before"
    assert flight.current(other)[-1] == 3
    assert [text for text in other.texts() if "set the waypoint" in text]
    flight.world.run_until(lambda _: flight.number == 1, 120)
    assert [message.seq for message in flight.station.messages("MISSION_ITEM_REACHED")] == [3], "the jump is flown"


@pytest.mark.parametrize("seq", [1, 6, 8])
def test_each_leg_and_the_return_can_be_set(seq: int, flight: Flight) -> None:
    flight.ask(set_current(seq))
    assert flight.current()[-1] == seq
    assert [message.severity for message in flight.station.messages("STATUSTEXT") if "Set WP" in message.text] == []


@pytest.mark.parametrize(
    "message",
    [long(3), m.MAVLink_command_int_message(1, 1, 0, SET_CURRENT, 0, 0, 3, 0, 0, 0, 0, 0, 0)],
    ids=lambda message: message.get_type(),
)
def test_the_command_is_acknowledged_once_it_is_flown(message: Message, flight: Flight) -> None:
    flight.ask(message)
    assert results(flight.station) == [ACCEPTED]
    assert flight.number == 3
    assert 3 in flight.current()


def test_other_items_are_refused_with_the_reason(flight: Flight) -> None:
    refused = {
        0: "Set WP: item 0 is home",
        2: "Set WP: item 2 (DO_SET_ROI) is not flown to",
        4: "Set WP: item 4 (DO_JUMP) is not flown to",
        5: "Set WP: item 5 (DO_CHANGE_SPEED) is not flown to",
        9: "Set WP: there is no item 9 on board",
        -1: "Set WP: there is no item -1 on board",
    }
    for seq in refused:
        flight.ask(long(seq))
    assert results(flight.station) == [DENIED] * len(refused)
    assert flight.station.texts() == [*refused.values()]
    assert (flight.sent(), flight.number) == ([], 1)


def test_the_mission_is_not_reset(flight: Flight) -> None:
    flight.ask(long(1, resets=1))
    assert results(flight.station) == [DENIED]
    assert flight.sent() == []


def test_on_the_ground_and_outside_of_the_waypoint_mode_it_is_refused() -> None:
    flight = Flight()
    flight.ask(long(3))
    flight.world.arm(then_s=2)
    flight.ask(long(3))
    assert results(flight.station) == [DENIED, DENIED]
    assert flight.station.texts().count("Set WP: only in flight, in NAV WP mode") == 2
    assert flight.sent() == []


def test_the_return_home_is_not_left(flight: Flight) -> None:
    flight.ask(set_current(8))
    flight.ask(long(3))
    assert results(flight.station) == [DENIED]
    assert len(flight.sent()) == 1


def test_a_landing_goes_on_without_a_new_take_off() -> None:
    flight = Flight([*MISSION[:2], leg(90, Command.NAV_LAND)]).begin()
    flight.world.run_until(lambda _: flight.status.state == NavState.LAND_IN_PROGRESS, 120)
    flight.ask(long(1))
    flight.world.run_until(lambda _: flight.has_finished, 120)
    flight.ask(long(1))
    assert results(flight.station) == [DENIED, DENIED]
    assert flight.station.texts().count("Set WP: it is landing, or has landed") == 2
    assert flight.sent() == []


def test_a_finished_mission_is_flown_on() -> None:
    flight = Flight([*MISSION[:2], leg(90)]).begin()
    flight.world.run_until(lambda _: flight.has_finished, 120)
    flight.ask(set_current(1))
    assert flight.number == 1
    assert not flight.has_finished
    flight.station.received.clear()
    flight.world.run_until(lambda _: flight.has_finished, 120)
    assert [message.seq for message in flight.station.messages("MISSION_ITEM_REACHED")] == [1, 2]


@pytest.mark.parametrize("version", ["7.1.2", "9.0.1"])
def test_older_versions_refuse_it(version: str) -> None:
    flight = Flight(version=version)
    nav_wp = 1 << BOXES[version].index(28)
    flight.begin()
    flight.board.faults.boxes = nav_wp
    flight.world.run(2)
    flight.ask(long(3))
    assert results(flight.station) == [DENIED]
    assert f"Set WP: needs INAV 9.1, this is {version}" in flight.station.texts()
    assert flight.number == 1


def test_only_one_request_runs_at_a_time_and_repeats_are_not_sent(flight: Flight) -> None:
    for seq in (3, 3, 6):
        flight.station.send(long(seq))
    flight.world.run(1)
    assert [frame.payload for frame in flight.sent()] == [b"\x02"]
    assert sorted(results(flight.station)) == [ACCEPTED, DENIED]
    assert "Set WP: another request is running, try again" in flight.station.texts()


def test_a_repeated_request_gets_the_same_item(flight: Flight) -> None:
    """MAVSDK, which requests no streams."""
    flight.world.run_until(lambda _: bool(flight.current()), 2)
    flight.station.received.clear()
    flight.ask(set_current(3), seconds=3)
    assert set(flight.current()) == {3}
    flight.station.received.clear()
    flight.ask(set_current(2), seconds=3)
    assert flight.current() == []


def test_the_item_has_the_number_of_the_list_that_the_station_sent() -> None:
    flight = Flight([MISSION[0], order(Command.NAV_TAKEOFF), *MISSION[1:]]).begin()
    reader = GroundStation(flight.world, "reader", sysid=254)
    assert len(Download(reader).run()) == len(MISSION)
    flight.ask(set_current(4))
    assert (flight.number, flight.current()[-1]) == (3, 4)
    flight.ask(set_current(1))
    assert "Set WP: there is no item 1 on board" in flight.station.texts()
    flight.ask(set_current(4), reader)
    assert "Set WP: item 4 (DO_JUMP) is not flown to" in reader.texts()


@pytest.mark.parametrize("links", [{}, {"udp": LinkAccess(may_write=lambda peer: peer.key == "pilot")}])
def test_a_station_on_an_open_link_or_without_rights_does_not_set_a_waypoint(links: dict[str, LinkAccess]) -> None:
    """On an open link it may write a mission."""
    flight = Flight(links=links)
    pilot = GroundStation(flight.world, "pilot")
    assert Upload(pilot, MISSION).run() is MissionResult.ACCEPTED
    flight.begin()
    flight.ask(set_current(3))
    flight.ask(long(3))
    assert (results(flight.station), flight.sent(), flight.number) == ([DENIED], [], 1)
    needs_key = "Set WP: needs a key, or pass_through = everything"
    assert (needs_key in flight.station.texts()) is not bool(links)
    flight.ask(set_current(3), pilot)
    assert flight.number == (3 if links else 1)


def test_an_unknown_mission_is_not_sent() -> None:
    inav = FakeInav(drop=lambda frame: "request" if frame.command == Nav.WP else "")
    inav.records, inav.is_valid, inav.armed = [FAKE], True, True
    world = World(speeds=(115200,), peer=inav, links=LINKS)
    world.wait_until(lambda world: world.is_found, 10, then_s=1)
    station = GroundStation(world)
    station.send(long(1), wait_s=0.5)
    assert (results(station), station.texts()) == ([DENIED], ["Set WP: read the mission from the board first"])
    assert 0x2221 not in inav.commands


def test_other_boards_refuse_it_as_before() -> None:
    world = ready_world(peer=make_board("multiwii", MspOptions(), Faults(boxes=0)), within_s=10)
    world.run(2)
    station = GroundStation(world)
    station.send(long(1), wait_s=0.5)
    assert (results(station), station.texts()) == ([DENIED], ["Use the MISSION switch to fly the mission"])
