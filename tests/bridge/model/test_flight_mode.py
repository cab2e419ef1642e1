# SPDX-License-Identifier: GPL-3.0-or-later
"""The mode shown for each combination of boxes."""

import pytest

from bridge.fc.profile import FlightController
from bridge.model.airframe import Airframe
from bridge.model.vehicle import Vehicle
from bridge.vehicle import vehicle_messages as make
from protocols.mavlink.dialect import messages as m
from tests.bridge.vehicle.test_vehicle_messages import BETAFLIGHT, HARAKIRI, INAV, at, status, with_replies


@pytest.mark.parametrize(
    ("who", "active", "copter_mode", "plane_mode", "rover_mode"),
    [
        (INAV, ("ANGLE",), 0, 2, 0),
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
