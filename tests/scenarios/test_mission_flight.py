# SPDX-License-Identifier: GPL-3.0-or-later
"""A mission that a Harakiri flies by itself, as ground stations see it, in each protocol of the armed board."""

from dataclasses import replace
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.support.conversations import Download, Upload, waypoints
from tests.support.settings_client import SettingsClient
from tests.support.world import GroundStation, World

MSP, MAVLINK, MAVLINK_57600 = TelemetryProtocol.MSP, TelemetryProtocol.MAVLINK, TelemetryProtocol.MAVLINK_57600
STABILIZE, AUTO, LOITER = 0, 3, 5
UNKNOWN, NOT_STARTED, ACTIVE, PAUSED, COMPLETE = 0, 2, 3, 4, 5
LEVEL, HOLD, SWITCH = 1 << 0, 1 << 7, 1 << 8
ON_GROUND, IN_AIR, TAKING_OFF, LANDING = 1, 2, 3, 4
HELLO = m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
LEG = FlightProgress(
    FlightPhase.LEG, switch_on=True, in_command=True, record=1, distance=42.4, bearing=270.0, height_error=-3.5
)


class Flight:
    """An armed craft with a list of five items, and a ground station that has written it."""

    def __init__(self, tele_prot: TelemetryProtocol = MSP, items: list[MissionItem] | None = None) -> None:
        self.faults = Faults(flight=FlightProgress())
        self.world = World(SimOptions(tele_prot=tele_prot), self.faults)
        self.world.wait_ready()
        self.station = GroundStation(self.world)
        self.world.run(6)
        assert Upload(self.station, items or waypoints(5)).run() is MissionResult.ACCEPTED
        self.faults.armed = True
        self.world.wait_until(lambda w: w.is_found and w.bridge.vehicle.armed is True, 10)
        self.world.run(3)
        self.station.take()

    def reports(self, progress: FlightProgress, seconds: float = 2.0) -> None:
        self.faults.flight = progress
        self.world.run(seconds)

    def last(self, name: str) -> Any:
        return self.station.messages(name)[-1]

    @property
    def mode(self) -> int:
        return int(self.last("HEARTBEAT").custom_mode)

    @property
    def current(self) -> tuple[int, int]:
        message = self.last("MISSION_CURRENT")
        return message.seq, message.mission_state

    @property
    def landed_state(self) -> int:
        return int(self.last("EXTENDED_SYS_STATE").landed_state)

    def reached(self) -> list[int]:
        return [message.seq for message in self.station.messages("MISSION_ITEM_REACHED")]


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK, MAVLINK_57600])
def test_a_list_is_followed_record_by_record(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    for number in (1, 2, 3, 4):
        flight.reports(replace(LEG, record=number, reached=number - 1 or None))
        assert flight.current == (number, ACTIVE)
        assert flight.mode == AUTO
    assert flight.reached() == [1, 2, 3]
    assert flight.world.bridge.report(flight.world.now).status.mode == "AUTO"


def test_records_reached_between_two_reports_are_all_announced() -> None:
    flight = Flight()
    flight.reports(LEG)
    flight.reports(replace(LEG, record=4, reached=3))
    assert flight.reached() == [1, 2, 3]


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_a_second_flight_announces_the_records_again(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    flight.reports(LEG)
    flight.reports(replace(LEG, record=2, reached=1))
    flight.reports(FlightProgress(record=2, reached=1, reason=FlightReason.SWITCHED_OFF), 3.0)
    assert flight.mode == STABILIZE
    flight.reports(LEG)
    flight.reports(replace(LEG, record=2, reached=1))
    assert flight.reached() == [1, 1]


def test_the_sender_sees_the_numbers_of_its_own_list() -> None:
    """Harakiri drops an item without an effect, so later ones have other numbers on the board."""
    home, *legs = waypoints(4)
    dropped = replace(legs[0], seq=2, command=Command.DO_CHANGE_SPEED)
    items = [home, legs[0], dropped, *(replace(leg, seq=leg.seq + 1) for leg in legs[1:])]
    flight = Flight(items=items)
    other = GroundStation(flight.world, "other", sysid=254)
    assert len(Download(other).run()) == 4
    flight.reports(LEG)
    flight.reports(replace(LEG, record=3, reached=2))
    assert (flight.current[0], flight.reached()) == (4, [1, 3])
    assert other.messages("MISSION_CURRENT")[-1].seq == 3


def test_the_reported_leg_is_the_boards_own() -> None:
    flight = Flight()
    flight.reports(LEG)
    way = flight.last("NAV_CONTROLLER_OUTPUT")
    assert (way.wp_dist, way.target_bearing, way.nav_bearing, way.alt_error) == (42, -90, -90, -3.5)


def test_in_mavlink_the_leg_follows_from_the_item() -> None:
    flight = Flight(MAVLINK)
    flight.reports(LEG)
    assert flight.last("NAV_CONTROLLER_OUTPUT").wp_dist > 0


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_take_off_and_landing_are_shown(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    for phase, landed_state in (
        (FlightPhase.WAIT, ON_GROUND),
        (FlightPhase.RISE, TAKING_OFF),
        (FlightPhase.LEG, IN_AIR),
        (FlightPhase.SINK, LANDING),
    ):
        flight.reports(replace(LEG, state=phase))
        assert flight.landed_state == landed_state


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_a_stopped_flight_is_paused_and_the_mode_is_that_of_the_boxes(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    flight.reports(LEG)
    flight.faults.boxes = LEVEL | HOLD
    flight.reports(replace(LEG, state=FlightPhase.HELD, reason=FlightReason.STICKS))
    assert (flight.current, flight.mode) == ((1, PAUSED), LOITER)
    assert flight.station.texts()[-1] == "Mission stopped: roll or pitch stick moved"


def texts_of(flight: Flight) -> list[str]:
    return [text for text in flight.station.texts() if "ission" in text]


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK_57600])
def test_a_reason_is_reported_once_and_again_after_another_start(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    stalled = replace(LEG, state=FlightPhase.HELD, reason=FlightReason.STALLED)
    for progress in (LEG, stalled, stalled, LEG, stalled):
        flight.reports(progress, 11.0)
    assert texts_of(flight) == ["Mission stopped: too slow against the wind"] * 2


def test_the_reason_from_an_earlier_flight_is_not_reported() -> None:
    flight = Flight()
    flight.reports(FlightProgress(reason=FlightReason.RTL))
    assert texts_of(flight) == []


def test_a_low_battery_is_reported_while_the_mission_flies() -> None:
    flight = Flight()
    flight.reports(replace(LEG, battery_low=True))
    assert "Battery low: land, or switch GPS HOME on" in flight.station.texts()


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_a_list_that_ends_with_the_landing_is_complete(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    flight.reports(replace(LEG, record=4, reached=3, state=FlightPhase.SINK))
    flight.faults.armed = False
    flight.reports(FlightProgress(record=4, reached=3, reason=FlightReason.DISARMED), 4.0)
    assert flight.current == (4, COMPLETE)
    assert flight.reached()[-1] == 4
    assert texts_of(flight) == ["Mission flown"]
    assert flight.landed_state == ON_GROUND


def test_disarming_in_the_air_does_not_complete_the_mission() -> None:
    flight = Flight()
    flight.reports(replace(LEG, record=4, reached=3))
    flight.reports(FlightProgress(record=4, reached=3, reason=FlightReason.DISARMED))
    assert flight.current == (0, NOT_STARTED)


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_old_values_are_not_shown_when_the_reports_end(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    flight.reports(replace(LEG, record=2, reached=1))
    assert flight.mode == AUTO
    flight.faults.flight = None
    flight.world.run(4)
    flight.station.take()
    flight.world.run(3)
    assert (flight.current, flight.mode) == ((0, UNKNOWN), STABILIZE)
    way = flight.station.messages("NAV_CONTROLLER_OUTPUT")
    assert not way
    mission = flight.world.bridge.report(flight.world.now).mission
    assert mission is not None
    assert mission.state is None
    assert mission.item is None


def test_a_restart_in_flight_does_not_announce_earlier_records() -> None:
    flight = Flight()
    flight.reports(replace(LEG, record=3, reached=2))
    flight.world.restart_bridge()
    station = flight.station = GroundStation(flight.world, "later")
    station.send(HELLO)
    flight.world.wait_ready()
    flight.world.run(3)
    assert (flight.current, flight.reached()) == ((3, ACTIVE), [])
    flight.reports(replace(LEG, record=4, reached=3))
    assert [message.seq for message in station.messages("MISSION_ITEM_REACHED")] == [3]


def asked(world: World) -> int:
    frames = [frame for _, _, data in world.written for frame in MspParser().feed(data)]
    return sum(frame.command == Msp.FLIGHT for frame in frames)


def test_a_board_without_mission_flight_is_asked_twice() -> None:
    world = World()
    world.wait_ready()
    world.run(30)
    assert asked(world) == 2


def test_the_switch_alone_does_not_start_a_flight() -> None:
    """In MAVLink only the pilot's switches are known; this board has no mission flight."""
    world = World(SimOptions(tele_prot=MAVLINK), faults := Faults(boxes=LEVEL | SWITCH))
    world.wait_ready()
    station = GroundStation(world)
    station.send(HELLO)
    world.run(6)
    faults.armed = True
    world.run(6)
    assert station.messages("HEARTBEAT")[-1].custom_mode == STABILIZE


def refused(custom_mode: int) -> list[Message]:
    return [
        m.MAVLink_command_long_message(1, 1, m.MAV_CMD_MISSION_START, 0, 0, 0, 0, 0, 0, 0, 0),
        m.MAVLink_mission_set_current_message(1, 1, 2),
        m.MAVLink_command_long_message(1, 1, m.MAV_CMD_DO_SET_MODE, 0, 1, custom_mode, 0, 0, 0, 0, 0),
        m.MAVLink_set_mode_message(1, 1, custom_mode),
    ]


def replies(world: World, message: Message) -> tuple[list[str], list[int]]:
    station = GroundStation(world, f"asks {world.now}")
    world.run(2)
    station.take()
    written = len(world.written)
    station.send(message)
    world.run(0.5)
    frames = [frame for _, _, data in world.written[written:] for frame in MspParser().feed(data)]
    assert all(frame.command < 200 for frame in frames), "nothing but reads"
    return station.texts(), [ack.result for ack in station.messages("COMMAND_ACK")]


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
@pytest.mark.parametrize("message", refused(AUTO), ids=lambda it: it.get_type())
def test_only_the_pilots_switch_flies_a_mission(tele_prot: TelemetryProtocol, message: Message) -> None:
    flight = Flight(tele_prot)
    texts, results = replies(flight.world, message)
    assert texts == ["Use the GPS AUTO switch to fly the mission"]
    assert set(results) <= {m.MAV_RESULT_DENIED}


@pytest.mark.parametrize("message", refused(AUTO), ids=lambda it: it.get_type())
def test_a_board_without_mission_flight_says_so(message: Message) -> None:
    world = World()
    world.wait_ready()
    world.run(2)
    assert replies(world, message)[0] == ["This flight controller cannot fly missions"]


@pytest.mark.parametrize("message", refused(LOITER)[2:], ids=lambda it: it.get_type())
def test_other_modes_are_set_by_other_switches(message: Message) -> None:
    assert replies(Flight().world, message)[0] == ["Modes are set with the transmitter switches"]


def test_the_limits_of_the_flight_are_read_from_the_board_by_name() -> None:
    faults = Faults(flight=FlightProgress())
    world = World(SimOptions(), faults)
    world.wait_ready()
    station = GroundStation(world)
    world.run(6)
    low = [replace(item, alt_m=20.0) for item in waypoints(5)]
    assert Upload(station, low).run() is MissionResult.ACCEPTED
    assert not [text for text in station.texts() if "not flown" in text]
    client = SettingsClient(world)
    client.wait_read()
    client.change("mission_height", 10)
    assert Upload(station, low).run() is MissionResult.ACCEPTED
    assert "WP 1: not flown: 20 m, mission_height 10 (+3)" in station.texts()


@pytest.mark.parametrize("tele_prot", [MSP, MAVLINK])
def test_decisions_of_the_core_are_logged(tele_prot: TelemetryProtocol) -> None:
    flight = Flight(tele_prot)
    held = replace(LEG, state=FlightPhase.HELD, reason=FlightReason.FIX_LOST, record=2)
    flight.reports(LEG)
    flight.reports(held)
    messages = [message for message in flight.station.messages("NAMED_VALUE_INT") if message.name == "flight"]
    assert [message.value for message in messages] == [LEG.summary, held.summary]


def test_the_state_reports_why_a_flight_has_stopped() -> None:
    flight = Flight()
    flight.reports(replace(LEG, state=FlightPhase.HELD, reason=FlightReason.STALLED))
    mission = flight.world.bridge.report(flight.world.now).mission
    assert mission is not None
    assert (mission.state, mission.why) == ("paused", "Mission stopped: too slow against the wind")
