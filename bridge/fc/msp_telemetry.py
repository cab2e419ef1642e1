# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings of the vehicle from MSP replies: the only place with the signs, orders and scales of common replies."""

import math
from collections.abc import Mapping

from bridge.fc.profile import Decoder, FlightController
from bridge.model import vehicle as v
from bridge.model.craft import ARM_BOX, FAILSAFE_BOX, flight_mode, names_of_active
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.nav import decode_nav_status
from protocols.msp.telemetry import (
    RawGps,
    Sensor,
    decode_altitude,
    decode_analog,
    decode_attitude,
    decode_box_activation,
    decode_channels,
    decode_home,
    decode_raw_gps,
    decode_status,
)

_MAX_RSSI = 1020
_STATUS_FLAGS = 32


def hear_msp(vehicle: v.Vehicle, frame: MspFrame, controller: FlightController, now: float) -> None:
    """Take one reply. Errors, replies that are too short and other commands do not change anything."""
    decode = controller.profile.decoders.get(frame.command) or _DECODERS.get(frame.command)
    if decode is not None and frame.direction is Direction.REPLY:
        decode(vehicle, frame.payload, controller, now)


def _attitude(vehicle: v.Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """MSP's pitch is nose-down positive on all firmware."""
    reply = decode_attitude(payload)
    if reply is not None:
        health = vehicle.last(v.Health)
        has_compass = health is not None and Sensor.COMPASS in health.sensors
        roll_ddeg, pitch_ddeg, heading_deg = reply
        angles_deg = roll_ddeg / 10, -pitch_ddeg / 10, float(heading_deg % 360)
        vehicle.hear(v.Orientation(now, v.Source.MSP, *angles_deg, has_compass))


def _raw_gps(vehicle: v.Vehicle, payload: bytes, controller: FlightController, now: float) -> None:
    gps = decode_raw_gps(payload)
    if gps is None:
        return
    fix = v.Fix.NO_FIX
    if gps.fix:
        fix = v.Fix.TWO_D if controller.profile.has_2d_fix and gps.fix == 1 else v.Fix.THREE_D
    if fix is v.Fix.NO_FIX:
        vehicle.hear(v.GpsFix(now, v.Source.MSP, fix, gps.satellites))
        return
    speed, course = gps.speed_cms / 100, _course_deg(vehicle, gps)
    hdop = None if gps.hdop_e2 is None else gps.hdop_e2 / 100
    vehicle.hear(v.GpsFix(now, v.Source.MSP, fix, gps.satellites, speed, course, hdop))
    north, east = velocity(speed, course)
    vehicle.hear(v.GlobalPosition(now, v.Source.MSP, gps.lat_e7, gps.lon_e7, float(gps.altitude_m), north, east))


def _course_deg(vehicle: v.Vehicle, gps: RawGps) -> float | None:
    return vehicle.track.course_deg(gps) if gps.course_ddeg is None else gps.course_ddeg / 10 % 360


def velocity(speed_m_s: float, course_deg: float | None) -> tuple[float | None, float | None]:
    """North and east parts of a speed over ground, or None while it moves and the course is unknown."""
    if course_deg is None:
        return (None, None) if speed_m_s else (0.0, 0.0)
    course = math.radians(course_deg)
    return speed_m_s * math.cos(course), speed_m_s * math.sin(course)


def _altitude(vehicle: v.Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """A board without a barometer answers zeros, which are not heights."""
    reply, health = decode_altitude(payload), vehicle.last(v.Health)
    if reply is None or health is None:
        return
    height_cm, climb_cm_s = reply
    if Sensor.BAROMETER in health.sensors or height_cm or climb_cm_s:
        vehicle.hear(v.Height(now, v.Source.MSP, height_cm / 100, climb_cm_s / 100))


def _status(vehicle: v.Vehicle, payload: bytes, controller: FlightController, now: float) -> None:
    status = decode_status(payload)
    if status is None:
        return
    vehicle.hear(v.Health(now, v.Source.MSP, status.sensors, status.cycle_time_us, status.i2c_errors))
    hear_box_flags(vehicle, status.box_flags, controller, now, known=_STATUS_FLAGS)


def hear_box_flags(vehicle: v.Vehicle, flags: int, controller: FlightController, now: float, *, known: int) -> None:
    """Take the flags of the first `known` boxes. A plane's failsafe on INAV is not among the 32 of STATUS."""
    active, before = names_of_active(flags, controller.boxes), vehicle.last(v.FlightState)
    if before is not None and before.is_failsafe and FAILSAFE_BOX in controller.boxes[known:]:
        active.add(FAILSAFE_BOX)
    armed = ARM_BOX in active if ARM_BOX in controller.boxes else None
    if controller.boxes:
        vehicle.hear(v.Mode(now, v.Source.MSP, flight_mode(active)))
    # While disarmed, the box only means that there is no RC link.
    vehicle.hear(v.FlightState(now, v.Source.MSP, armed, bool(armed) and FAILSAFE_BOX in active))


def _analog(vehicle: v.Vehicle, payload: bytes, controller: FlightController, now: float) -> None:
    """A voltage of 0, a current before any charge, and a strength before the first signal are not measured."""
    reply = decode_analog(payload)
    if reply is None:
        return
    voltage = reply.battery_v or None
    if reply.current is None or not (reply.current or reply.drawn_mah):
        vehicle.hear(v.Power(now, v.Source.MSP, voltage))
    else:
        current_a = reply.current / controller.profile.currents_per_a
        vehicle.hear(v.Power(now, v.Source.MSP, voltage, current_a))
        vehicle.hear(v.Charge(now, v.Source.MSP, reply.drawn_mah or 0))
    if reply.rssi or vehicle.last(v.Signal) is not None:
        vehicle.hear(v.Signal(now, v.Source.MSP, min(reply.rssi / _MAX_RSSI, 1.0)))


def _rc(vehicle: v.Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """MSP sends roll, pitch, yaw, throttle, aux."""
    channels = decode_channels(payload)
    if channels is not None:
        roll, pitch, yaw, throttle, *aux = channels
        vehicle.hear(v.Sticks(now, v.Source.MSP, (roll, pitch, throttle, yaw, *aux)))


def _box(vehicle: v.Vehicle, payload: bytes, controller: FlightController, now: float) -> None:
    activation = decode_box_activation(payload, len(controller.boxes))
    if activation is not None:
        vehicle.hear(v.Switches(now, v.Source.MSP, controller.boxes, activation))


def _wp(vehicle: v.Vehicle, payload: bytes, _controller: FlightController, _now: float) -> None:
    home = decode_home(payload)
    if home is not None:
        vehicle.hear_home(*home)


def _nav_status(vehicle: v.Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    status = decode_nav_status(payload)
    if status is not None:
        vehicle.hear(v.MissionLeg(now, v.Source.MSP, status))


_DECODERS: Mapping[int, Decoder] = {
    Msp.ATTITUDE: _attitude,
    Msp.RAW_GPS: _raw_gps,
    Msp.ALTITUDE: _altitude,
    Msp.STATUS: _status,
    Msp.ANALOG: _analog,
    Msp.RC: _rc,
    Msp.BOX: _box,
    Msp.WP: _wp,
    Msp.NAV_STATUS: _nav_status,
}
