# SPDX-License-Identifier: GPL-3.0-or-later
"""The mode shown for each combination of boxes."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.profile import FlightController
from bridge.model.airframe import Airframe
from bridge.model.vehicle import Vehicle
from bridge.vehicle import vehicle_messages as make
from tests.bridge.vehicle.test_vehicle_messages import BETAFLIGHT, HARAKIRI, INAV, at, status, with_replies

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
@pytest.mark.parametrize("box", INAVS_OWN)
def test_an_aeroplanes_modes_are_those_of_inavs_own_mavlink(box: str, levelled: str) -> None:
    cruise = ("NAV COURSE HOLD", "NAV ALTHOLD") if box == "NAV CRUISE" else ()
    active = {box, levelled, *cruise} - {""}
    state = with_replies(Vehicle(), INAV, STATUS=status(flags=sum(1 << INAV.boxes.index(name) for name in active)))
    state.airframe = Airframe.FIXED_WING
    own = next(number for name, number in INAVS_OWN.items() if name in active or not name)
    assert make.heartbeat(at(state)).custom_mode == (INAVS_OWN["NAV CRUISE"] if box == UNNUMBERED else own)


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
