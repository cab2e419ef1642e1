# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's MAVLink messages where their meaning is its own."""

import math

from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers.harakiri.profile import HarakiriReadings
from bridge.fc.mavlink_telemetry import MavlinkTelemetry
from bridge.model.vehicle import GlobalPosition, Height, Orientation, Signal, Vehicle
from bridge.vehicle import vehicle_messages as make
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import kinds


def heard(vehicle: Vehicle, *sent: Message) -> None:
    sender, telemetry = m.MAVLink(None, srcSystem=1, srcComponent=200), MavlinkTelemetry(HarakiriReadings(vehicle))
    for message in sent:
        frame = bytes(message.pack(sender))
        telemetry.take([frame], kinds([frame]), 1.0)


def test_position_and_height_are_in_gps_raw_int_and_vfr_hud() -> None:
    vehicle = Vehicle()
    heard(
        vehicle,
        m.MAVLink_gps_raw_int_message(1, 3, 453838000, 84733000, 131000, 65535, 65535, 300, 9000, 9),
        m.MAVLink_vfr_hud_message(0.0, 3.0, 90, 50, 12.5, 0.5),
    )
    place, height = vehicle.last(GlobalPosition), vehicle.last(Height)
    assert place is not None
    assert height is not None
    assert (place.lat_e7, place.lon_e7, place.altitude_m, place.east_m_s) == (453838000, 84733000, 131.0, 3.0)
    assert (height.height_m, height.climb_m_s) == (12.5, 0.5)


def test_rates_are_unknown_and_north_needs_a_compass() -> None:
    vehicle = Vehicle()
    attitude = m.MAVLink_attitude_message(1000, 0.1, 0.2, 0.3, 1.0, 1.0, 1.0)
    heard(vehicle, attitude)
    before = vehicle.last(Orientation)
    compass = m.MAV_SYS_STATUS_SENSOR_3D_MAG
    heard(vehicle, m.MAVLink_sys_status_message(compass, compass, compass, 0, 0, -1, -1, 0, 0, 0, 0, 0, 0), attitude)
    after = vehicle.last(Orientation)
    assert before is not None
    assert after is not None
    packed = FrameWriter(1, 1).frame(make.attitude(make.Moment(vehicle, 1.0, 0)), 2)
    shown = m.MAVLink(None).decode(bytearray(packed))
    assert all(math.isnan(rate) for rate in (shown.rollspeed, shown.pitchspeed, shown.yawspeed))
    assert (before.is_north_known, after.is_north_known) == (False, True)


def test_signal_strength_0_is_unknown_until_a_first_signal() -> None:
    """It sends 0 without such a receiver. After the first other value, 0 is a lost signal."""
    vehicle, strengths, sender = Vehicle(), [], m.MAVLink(None, srcSystem=1, srcComponent=1)
    telemetry = MavlinkTelemetry(HarakiriReadings(vehicle))
    for now, rssi in enumerate((0, 0, 255, 51, 0)):
        frame = bytes(m.MAVLink_rc_channels_raw_message(1, 0, *[1500] * 8, rssi).pack(sender))
        telemetry.take([frame], kinds([frame]), now)
        signal = vehicle.last(Signal)
        strengths.append(None if signal is None else (signal.strength, signal.heard_at))
    assert strengths == [None, None, (1.0, 2), (0.2, 3), (0.0, 4)]
