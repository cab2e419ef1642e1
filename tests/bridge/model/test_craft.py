# SPDX-License-Identifier: GPL-3.0-or-later
"""The kind of aircraft by its mixer, the flight mode, and the memory of a flight."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.profile import FlightController
from bridge.model.craft import Airframe, airframe
from bridge.model.vehicle import Vehicle
from bridge.vehicle import vehicle_messages as make
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from tests.bridge.vehicle.test_vehicle_messages import BETAFLIGHT, HARAKIRI, INAV, at, status, with_replies
from tests.support.screens import Screens
from tests.support.world import GroundStation, World

#: MULTITYPE_TRI is 1.
_MIXERS = (
    *("TRI", "QUADP", "QUADX", "BI", "GIMBAL", "Y6", "HEX6", "FLYING_WING", "Y4"),
    *("HEX6X", "OCTOX8", "OCTOFLATP", "OCTOFLATX", "AIRPLANE", "HELI_120_CCPM", "HELI_90_DEG", "VTAIL4", "HEX6H"),
)
#: MAV_TYPE by the beginning of the mixer's name; others are quadrotors.
_SHOWN = {"TRI": 15, "Y6": 13, "HEX": 13, "OCTO": 14, "FLYING_WING": 1, "AIRPLANE": 1, "HELI": 4}


def test_a_mixer_is_shown_as_the_kind_of_aircraft_or_as_a_quadrocopter() -> None:
    vehicle = Vehicle()
    for number, mixer in [*enumerate(_MIXERS, 1), (99, "unknown")]:
        vehicle.airframe = airframe(number)
        expected = next((shown for begin, shown in _SHOWN.items() if mixer.startswith(begin)), 2)
        assert make.heartbeat(at(vehicle)).type == expected, mixer


#: The numbers of INAV 9.1's own MAVLink for an aeroplane (telemetry/mavlink.c), in the order in which it looks for the
#: modes (fc/runtime_config.c).
INAVS_OWN = {
    "MANUAL": 0, "NAV LAUNCH": 13, "NAV RTH": 11, "NAV POSHOLD": 12, "NAV CRUISE": 7, "NAV COURSE HOLD": 23,
    "NAV WP": 10, "NAV ALTHOLD": 6, "ANGLE": 5, "HORIZON": 2, "ANGLE HOLD": 2, "": 4,
}  # fmt: skip
#: INAV has no number for it, and sends the one after its last, ArduPlane's QACRO.
UNNUMBERED = "NAV COURSE HOLD"


@pytest.mark.parametrize(
    ("who", "active", "copter_mode", "plane_mode", "rover_mode"),
    [
        (INAV, ("ANGLE",), 0, 5, 0),
        (INAV, ("HORIZON",), 0, 2, 0),
        (INAV, ("MANUAL",), 1, 0, 0),
        (INAV, ("NAV COURSE HOLD",), 5, 7, 1),
        (INAV, ("NAV COURSE HOLD", "NAV CRUISE", "NAV ALTHOLD"), 5, 7, 1),
        (INAV, ("NAV LAUNCH", "ANGLE"), 0, 13, 0),
        (INAV, ("ANGLE", "NAV ALTHOLD"), 2, 6, 0),
        (INAV, ("NAV ALTHOLD", "NAV POSHOLD"), 5, 12, 5),
        (INAV, ("NAV RTH", "NAV POSHOLD"), 6, 11, 11),
        (INAV, ("NAV WP", "ANGLE"), 3, 10, 10),
        (INAV, (), 1, 4, 0),
        (BETAFLIGHT, ("GPS RESCUE", "ANGLE"), 6, 11, 11),
        (BETAFLIGHT, ("ALT HOLD",), 2, 6, 0),
        (HARAKIRI, ("BARO", "ANGLE"), 2, 6, 0),
    ],
)
def test_the_active_boxes_determine_the_mode(
    who: FlightController, active: tuple[str, ...], copter_mode: int, plane_mode: int, rover_mode: int
) -> None:
    flags = sum(1 << who.boxes.index(name) for name in ("ARM", *active))
    copter, plane, rover, boat = Airframe.QUADROTOR, Airframe.FIXED_WING, Airframe.ROVER, Airframe.BOAT
    for kind, mode in ((copter, copter_mode), (plane, plane_mode), (rover, rover_mode), (boat, rover_mode)):
        state = with_replies(Vehicle(), who, STATUS=status(flags=flags))
        state.airframe = kind
        beat = make.heartbeat(at(state))
        assert (beat.custom_mode, beat.system_status) == (mode, m.MAV_STATE_ACTIVE)
        assert state.armed


@pytest.mark.parametrize("levelled", ["", "ANGLE", "HORIZON", "ANGLE HOLD"])
def test_an_aeroplanes_modes_are_those_of_inavs_own_mavlink(levelled: str) -> None:
    for box in INAVS_OWN:
        cruise = ("NAV COURSE HOLD", "NAV ALTHOLD") if box == "NAV CRUISE" else ()
        active = {box, levelled, *cruise} - {""}
        state = with_replies(Vehicle(), INAV, STATUS=status(flags=sum(1 << INAV.boxes.index(name) for name in active)))
        state.airframe = Airframe.FIXED_WING
        own = next(number for name, number in INAVS_OWN.items() if name in active or not name)
        assert make.heartbeat(at(state)).custom_mode == (INAVS_OWN["NAV CRUISE"] if box == UNNUMBERED else own), box


def test_an_aeroplane_and_a_rover_list_their_own_modes_under_ardupilots_names() -> None:
    vehicle = Vehicle()
    for kind, names in (
        (Airframe.FIXED_WING, {
            0: "MANUAL", 2: "STABILIZE", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE", 10: "AUTO", 11: "RTL",
            12: "LOITER", 13: "TAKEOFF",
        }),
        (Airframe.BOAT, {0: "MANUAL", 1: "ACRO", 5: "LOITER", 10: "AUTO", 11: "RTL"}),
    ):  # fmt: skip
        vehicle.airframe = kind
        listed = make.available_modes(vehicle)
        assert {mode.custom_mode: mode.mode_name for mode in listed} == names
        assert [mode.mode_index for mode in listed] == [*range(1, len(names) + 1)]
        assert {mode.number_modes for mode in listed} == {len(names)}


BARO_AND_ANGLE = 0b101
GPS_HOLD = 1 << 7


def flying(protocol: TelemetryProtocol, boxes: int = BARO_AND_ANGLE) -> tuple[World, GroundStation, Screens]:
    """A craft armed 30 s ago, 25 m and more from where it was armed."""
    faults = Faults(boxes=boxes)
    world = World(SimOptions(tele_prot=protocol), faults)
    world.wait_ready()
    station = GroundStation(world).stay_connected(wait_s=3)
    faults.armed = True
    world.run(30)
    return world, station, Screens(station)


def home(station: GroundStation) -> tuple[int, int, int]:
    (*_, last) = station.messages("HOME_POSITION")
    return last.latitude, last.longitude, last.altitude


@pytest.mark.parametrize(("protocol", "boxes"), [
    (TelemetryProtocol.MSP, GPS_HOLD), (TelemetryProtocol.MAVLINK_57600, GPS_HOLD),
    (TelemetryProtocol.FRSKY_9600, BARO_AND_ANGLE),
])  # fmt: skip
def test_mode_arming_and_home_stay_as_they_are(protocol: TelemetryProtocol, boxes: int) -> None:
    world, station, screens = flying(protocol, boxes)
    before, placed = screens.glance(), home(station)
    assert before.armed
    assert before.mode == ("AltHold" if boxes == BARO_AND_ANGLE else "Loiter")
    restarted_at = world.now
    world.restart_bridge()
    for glance in screens.look(2.0, 3.0, 5.0, 9.0, 15.0):
        assert (glance.armed, glance.mode, glance.failsafe) == (True, before.mode, False)
    assert set(screens.mission_planner.armed.values(restarted_at)) <= {True}
    assert set(screens.mission_planner.mode.values(restarted_at)) <= {before.mode}
    assert home(station) == placed
    assert world.bridge.vehicle.home == world.flight.home  # type: ignore[union-attr]


def test_without_memory_the_mode_is_a_guess() -> None:
    """The board reports neither its switch ranges nor home."""
    world, _, screens = flying(TelemetryProtocol.MAVLINK_57600, GPS_HOLD)
    world.restart_bridge(flight=False)
    assert screens.look(10.0)[0].mode == "Acro"
    assert world.bridge.vehicle.home is None


def test_an_unseen_landing_ends_the_flight() -> None:
    world, station, screens = flying(TelemetryProtocol.MAVLINK_57600)
    placed = home(station)
    world.at(world.now + 1.0, lambda: setattr(world.faults, "armed", False))
    world.restart_bridge(20.0)
    world.wait_ready(then_s=8)
    assert not screens.glance().armed
    assert world.flight is None
    assert home(station)[:2] != placed[:2]


def test_a_board_that_was_restarted_and_armed_again_is_another_flight() -> None:
    world, _, _ = flying(TelemetryProtocol.MAVLINK_57600)
    before = world.flight
    world.power_off()
    world.faults.armed = False
    world.naze.power_on(world.now)
    world.at(world.now + 10.0, lambda: setattr(world.faults, "armed", True))
    world.restart_bridge(20.0)
    world.run(10)
    after = world.flight
    assert before is not None
    assert after is not None
    assert after.armed_at > before.armed_at + 20
    assert after.home is None


def test_the_memory_is_made_on_arming_and_ends_on_disarming() -> None:
    world, _, _ = flying(TelemetryProtocol.MAVLINK_57600)
    memories = {id(world.flight)}
    for _ in range(20):
        world.run(1)
        memories.add(id(world.flight))
    assert len(memories) == 1
    world.faults.armed = False
    world.run(10)
    assert world.flight is None


def test_a_craft_that_is_not_found_again_is_lost() -> None:
    world, _, screens = flying(TelemetryProtocol.MAVLINK_57600)
    world.power_off()
    world.restart_bridge()
    (glance,) = screens.look(10.0)
    assert (glance.armed, glance.failsafe) == (True, True)
    assert any("Flight controller lost" in text for text in screens.mission_planner.texts(world.now - 10))
