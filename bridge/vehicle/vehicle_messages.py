# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink messages of the vehicle that the bridge represents (docs/telemetry.md).

An unknown or stale value is sent as MAVLink's "unknown". A message without such a value is not made.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from bridge.fc.mavlink_telemetry import SENSORS
from bridge.model import vehicle as v
from bridge.model.craft import Airframe, FlightMode, Home
from bridge.model.ground_track import bearing_deg, distance_m, north_east_m
from bridge.model.missions import FlownMission, Way
from bridge.vehicle.readiness import ReadyState
from protocols.mavlink.codec import pack_attitude
from protocols.mavlink.dialect import Message, messages
from protocols.mission_item import Command
from reports.vehicle_groups import Progress
from reports.verdict import SentSeqs


class _ModeNumbers(NamedTuple):
    """custom_mode of ArduCopter, ArduPlane and ArduRover, and MAV_STANDARD_MODE."""

    copter: int
    plane: int
    rover: int
    standard: int = messages.MAV_STANDARD_MODE_NON_STANDARD


#: An aeroplane's are those of INAV's own MAVLink (telemetry/mavlink.c), except for NAV COURSE HOLD, which INAV does not
#: number. Unless it navigates, a rover is steered by hand: MANUAL, 0; ArduRover's ACRO, 1, holds the course. Of modes
#: with the same number, the first gives the name.
_MODES = {
    FlightMode.STABILIZE: _ModeNumbers(0, 5, 0),
    FlightMode.HORIZON: _ModeNumbers(0, 2, 0),
    FlightMode.ACRO: _ModeNumbers(1, 4, 0),
    FlightMode.MANUAL: _ModeNumbers(1, 0, 0),
    FlightMode.ALT_HOLD: _ModeNumbers(2, 6, 0, messages.MAV_STANDARD_MODE_ALTITUDE_HOLD),
    FlightMode.AUTO: _ModeNumbers(3, 10, 10, messages.MAV_STANDARD_MODE_MISSION),
    FlightMode.LOITER: _ModeNumbers(5, 12, 5, messages.MAV_STANDARD_MODE_POSITION_HOLD),
    FlightMode.CRUISE: _ModeNumbers(5, 7, 1, messages.MAV_STANDARD_MODE_CRUISE),
    FlightMode.RTL: _ModeNumbers(6, 11, 11, messages.MAV_STANDARD_MODE_SAFE_RECOVERY),
    FlightMode.LAUNCH: _ModeNumbers(0, 13, 0, messages.MAV_STANDARD_MODE_TAKEOFF),
}
#: ArduPilot's names, where they are not ours.
_PLANE_NAMES = {2: "STABILIZE", 5: "FBWA", 6: "FBWB", 13: "TAKEOFF"}
_ROVER_NAMES = {0: "MANUAL", 1: "ACRO"}
#: Modes in which the craft steers itself.
_GUIDED = (FlightMode.LOITER, FlightMode.CRUISE, FlightMode.RTL, FlightMode.AUTO, FlightMode.LAUNCH)
_ROVERS = (Airframe.ROVER, Airframe.BOAT)
#: Without motor outputs Mission Planner shows a safety switch that is on.
_MOTORS = messages.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
_PREARM = messages.MAV_SYS_STATUS_PREARM_CHECK
#: A fence does not exist, but without this bit MAVProxy reports "fence breach".
_ALWAYS_HEALTHY = messages.MAV_SYS_STATUS_GEOFENCE

_CAPABILITIES = (
    messages.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | messages.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | messages.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | messages.MAV_PROTOCOL_CAPABILITY_MAVLINK2
)
_NO_MISSION = 0xFFFF
#: For firmware that does not report a version: below 1.0 Mission Planner hides the choice of altitude frames.
_UNKNOWN_VERSION = (1, 0, 0)
_OFFICIAL = 255
_UNKNOWN_U16 = 0xFFFF
_UNKNOWN_U8 = 0xFF
_CHANNELS = 18
#: Cells in BATTERY_STATUS.
_MOST_CELLS = 10
_MAX_RSSI = 254
_UNKNOWN_RATES = (math.nan, math.nan, math.nan)
#: An armed craft this far above or below home, or faster, is in the air.
_FLYING_M, _FLYING_M_S = 1.0, 0.5
_THROTTLE = 2
_STICK_LOW_US, _STICK_HIGH_US = 1000, 2000

T = TypeVar("T")


class Unknown(Exception):
    """A value is unknown or stale, which the message cannot express, so it cannot be made."""


def known(value: T | None) -> T:
    """The value; Unknown for None."""
    if value is None:
        raise Unknown
    return value


@dataclass(slots=True)
class Moment:
    """The vehicle at one moment. now: monotonic s.

    unix_time_s: the Pi's clock at a monotonic time, None if it is not set. sent_seqs: the receiver's.
    """

    vehicle: v.Vehicle
    now: float
    boot_ms: int
    mission: Callable[[], FlownMission] = FlownMission
    unix_time_s: Callable[[float], float | None] = lambda _now: None
    sent_seqs: SentSeqs = ()
    readiness: ReadyState = ReadyState.READY

    def fresh(self, kind: type[v.ReadingT]) -> v.ReadingT | None:
        reading = self.vehicle.last(kind)
        limit_s = self.vehicle.stale_s.get(kind, v.STALE_S)
        return reading if reading is not None and self.now <= reading.heard_at + limit_s else None

    def need(self, kind: type[v.ReadingT]) -> v.ReadingT:
        """The latest reading of a kind; Unknown if there is none or it is stale."""
        reading = self.vehicle.last(kind)
        if reading is None or self.now > reading.heard_at + self.vehicle.stale_s.get(kind, v.STALE_S):
            raise Unknown
        return reading

    def made(self, *makers: "Maker") -> list[Message]:
        """The messages of these makers that are not Unknown."""
        made = []
        for maker in makers:
            try:
                made.append(maker(self))
            except Unknown:
                continue
        return made

    def altitude_m(self) -> float | None:
        """Above mean sea level, by GPS, as in all other sinks. Without it home's altitude plus the height above it."""
        home, height, position = self.vehicle.home, self.fresh(v.Height), self.fresh(v.GlobalPosition)
        if position is not None and position.altitude_m is not None:
            return position.altitude_m
        return None if home is None or home.altitude_m is None or height is None else home.altitude_m + height.height_m


#: Makes a message of the vehicle at a moment. Raises Unknown if too little is known.
Maker = Callable[[Moment], Message]


def heartbeat(at: Moment) -> Message:
    """HEARTBEAT: an ArduPilot copter, plane or rover. A lost craft stays armed and in its mode, as last heard.

    An armed craft on the ground is in STANDBY, as with ArduPilot: to QGroundControl, ACTIVE means flying.
    """
    vehicle = at.vehicle
    state = vehicle.last(v.FlightState)
    last = vehicle.last(v.Mode)
    mode = last.mode if last is not None and isinstance(last.mode, FlightMode) else FlightMode.STABILIZE
    base_mode = messages.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if mode not in (FlightMode.ACRO, FlightMode.MANUAL):
        base_mode |= messages.MAV_MODE_FLAG_STABILIZE_ENABLED
    if mode in _GUIDED:
        base_mode |= messages.MAV_MODE_FLAG_GUIDED_ENABLED
    if vehicle.armed:
        base_mode |= messages.MAV_MODE_FLAG_SAFETY_ARMED
    status = at.readiness.system_status
    if state is not None and state.is_failsafe:
        status = messages.MAV_STATE_CRITICAL
    elif vehicle.armed and not at.readiness.is_lost:
        is_flying = _landed_state(at) != messages.MAV_LANDED_STATE_ON_GROUND
        status = messages.MAV_STATE_ACTIVE if is_flying else messages.MAV_STATE_STANDBY
    return messages.MAVLink_heartbeat_message(
        vehicle.airframe, messages.MAV_AUTOPILOT_ARDUPILOTMEGA, base_mode, _custom_mode(vehicle, mode), status, 3
    )


def available_modes(vehicle: v.Vehicle) -> list[Message]:
    """AVAILABLE_MODES, one message per mode."""
    modes: dict[int, FlightMode] = {}
    for mode in _MODES:
        modes.setdefault(_custom_mode(vehicle, mode), mode)
    names = {Airframe.FIXED_WING: _PLANE_NAMES, **dict.fromkeys(_ROVERS, _ROVER_NAMES)}.get(vehicle.airframe, {})
    return [
        messages.MAVLink_available_modes_message(
            len(modes),
            index,
            _standard_mode(vehicle, mode),
            custom_mode,
            messages.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE,  # the pilot's switches set the mode
            names.get(custom_mode, mode.name).encode(),
        )
        for index, (custom_mode, mode) in enumerate(modes.items(), 1)
    ]


def _custom_mode(vehicle: v.Vehicle, mode: FlightMode) -> int:
    numbers = _MODES[mode]
    if vehicle.airframe is Airframe.FIXED_WING:
        return numbers.plane
    return numbers.rover if vehicle.airframe in _ROVERS else numbers.copter


def auto_mode(vehicle: v.Vehicle) -> int:
    """custom_mode of AUTO."""
    return _custom_mode(vehicle, FlightMode.AUTO)


def _standard_mode(vehicle: v.Vehicle, mode: FlightMode) -> int:
    """MAV_STANDARD_MODE. Only copters hold an altitude or a position, only aeroplanes cruise and are launched."""
    is_copter = vehicle.airframe not in (Airframe.FIXED_WING, *_ROVERS)
    is_plane = vehicle.airframe is Airframe.FIXED_WING
    of_one_kind = {
        FlightMode.ALT_HOLD: is_copter,
        FlightMode.LOITER: is_copter,
        FlightMode.CRUISE: is_plane,
        FlightMode.LAUNCH: is_plane,
    }
    return _MODES[mode].standard if of_one_kind.get(mode, True) else messages.MAV_STANDARD_MODE_NON_STANDARD


def autopilot_version(vehicle: v.Vehicle, capabilities: int = 0) -> Message:
    """AUTOPILOT_VERSION: the firmware's version. `capabilities`: of this flight controller, besides the bridge's."""
    version = int.from_bytes(bytes((*(vehicle.version or _UNKNOWN_VERSION), _OFFICIAL)), "big")
    no_hash = [0] * 8
    return messages.MAVLink_autopilot_version_message(
        _CAPABILITIES | capabilities, version, 0, 0, 0, no_hash, no_hash, no_hash, 0, 0, 0
    )


def mission_current(at: Moment) -> Message:
    """MISSION_CURRENT: `total` is 0 while the list is unknown."""
    mission = at.mission()
    seq, last = mission.counted(at.sent_seqs)
    total = _NO_MISSION if mission.progress is Progress.NO_MISSION else last
    return messages.MAVLink_mission_current_message(seq, total, mission.progress.value, 0)


def attitude(at: Moment) -> Message:
    """ATTITUDE: radians, radians a second."""
    now = at.need(v.Orientation)
    heading_deg = (now.heading_deg + 180) % 360 - 180
    angles = map(math.radians, (now.roll_deg, now.pitch_deg, heading_deg))
    return pack_attitude(at.boot_ms, *angles, *_UNKNOWN_RATES)


def gps_raw_int(at: Moment) -> Message:
    """GPS_RAW_INT: degrees * 1e7, mm above mean sea level, cm/s, 0.01 degrees."""
    gps = at.need(v.GpsFix)
    position = at.fresh(v.GlobalPosition) if gps.fix is not v.Fix.NO_FIX else None
    place = 0, 0, 0
    if position is not None and position.altitude_m is not None:
        place = position.lat_e7, position.lon_e7, _fit(round(position.altitude_m * 1000), 32)
    return messages.MAVLink_gps_raw_int_message(
        at.boot_ms * 1000,
        gps.fix,
        *place,
        _scaled_u16(gps.hdop, 100),
        _UNKNOWN_U16,
        _scaled_u16(gps.ground_speed_m_s, 100),
        _UNKNOWN_U16 if gps.course_deg is None else round(gps.course_deg * 100) % 36000,
        _UNKNOWN_U8 if gps.satellites is None else gps.satellites,
    )


def global_position_int(at: Moment) -> Message:
    """GLOBAL_POSITION_INT: mm, cm/s, 0.01 degrees. Position, velocity and height have no "unknown".

    Mission Planner does not show another height. So without a fix it carries the last known place, as ArduPilot's does,
    and zeros if there was none, which Mission Planner and QGroundControl ignore.
    """
    height, place, orientation = at.need(v.Height), at.vehicle.last(v.GlobalPosition), at.fresh(v.Orientation)
    altitude_m, north_m_s, east_m_s = at.altitude_m(), 0.0, 0.0
    if (position := at.fresh(v.GlobalPosition)) is not None:
        known(altitude_m)
        north_m_s, east_m_s = known(position.north_m_s), known(position.east_m_s)
    elif place is not None:
        # A silent GPS is not a lost fix.
        at.need(v.GpsFix)
    is_north_known = orientation is not None and orientation.is_north_known
    return messages.MAVLink_global_position_int_message(
        at.boot_ms,
        0 if place is None else place.lat_e7,
        0 if place is None else place.lon_e7,
        _fit(round((altitude_m or 0.0) * 1000), 32),
        _fit(round(height.height_m * 1000), 32),
        _fit(round(north_m_s * 100), 16),
        _fit(round(east_m_s * 100), 16),
        _fit(round(-height.climb_m_s * 100), 16),
        round(orientation.heading_deg * 100) % 36000 if orientation and is_north_known else _UNKNOWN_U16,
    )


def vfr_hud(at: Moment) -> Message:
    """VFR_HUD: m/s, degrees, percent of the throttle stick, metres above mean sea level.

    Without a sensor a copter's airspeed is the ground speed, as with ArduCopter. A plane's is unknown. Heading and
    throttle have no "unknown", so both must be there.
    """
    orientation, channels_us = at.need(v.Orientation), at.need(v.Sticks).channels_us
    if len(channels_us) <= _THROTTLE:
        raise Unknown
    height, gps, altitude_m = at.fresh(v.Height), at.fresh(v.GpsFix), at.altitude_m()
    speed = math.nan if gps is None or gps.ground_speed_m_s is None else gps.ground_speed_m_s
    air = at.fresh(v.Airspeed)
    airspeed = math.nan if at.vehicle.airframe is Airframe.FIXED_WING else speed
    throttle = (channels_us[_THROTTLE] - _STICK_LOW_US) * 100 // (_STICK_HIGH_US - _STICK_LOW_US)
    return messages.MAVLink_vfr_hud_message(
        airspeed if air is None else air.airspeed_m_s,
        speed,
        round(orientation.heading_deg) % 360,
        min(max(throttle, 0), 100),
        math.nan if altitude_m is None else altitude_m,
        math.nan if height is None else height.climb_m_s,
    )


def sys_status(at: Moment) -> Message:
    """SYS_STATUS: mV, cA. errors_comm counts the failed I2C reads.

    Only what is known is enabled: Mission Planner replaces the line on the HUD by the first enabled sensor that is not
    healthy. A GPS without a 3D fix is not: to MAVSDK its bit means a good position.
    """
    health, fresh_health = at.vehicle.last(v.Health), at.fresh(v.Health)
    present, unknown, bad = _MOTORS | _PREARM, 0, 0
    if health is not None:
        present |= messages.MAV_SYS_STATUS_SENSOR_3D_GYRO
        for bit, sensor in SENSORS.items():
            if sensor & health.sensors:
                present |= bit
    gps, sticks, signal = at.fresh(v.GpsFix), at.fresh(v.Sticks), at.fresh(v.Signal)
    if gps is None:
        unknown |= messages.MAV_SYS_STATUS_SENSOR_GPS
    elif gps.fix is not v.Fix.THREE_D:
        bad |= messages.MAV_SYS_STATUS_SENSOR_GPS
    if at.vehicle.last(v.Sticks) is not None:
        present |= messages.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
        if sticks is None:
            unknown |= messages.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
        elif signal is not None and not signal.strength:
            bad |= messages.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    if not (at.vehicle.armed or at.readiness.may_arm):
        bad |= _PREARM
    enabled, healthy = present & ~unknown, present & ~unknown & ~bad
    if fresh_health is None:
        # Readiness is shown while disarmed only. Without the bit QGroundControl would keep the last answer.
        enabled, healthy = _MOTORS | (0 if at.vehicle.armed else _PREARM), healthy & _PREARM
    voltage, current, remaining = _battery(at)
    last_power = at.vehicle.last(v.Power)
    if last_power is not None and last_power.remaining_percent is not None:
        # Mission Planner would show an unknown charge as 0 %, beside the last voltage, which stays on its screen.
        remaining = last_power.remaining_percent
    load = at.fresh(v.Load)
    return messages.MAVLink_sys_status_message(
        present,
        enabled,
        healthy | _ALWAYS_HEALTHY,
        0 if load is None else round(load.cpu_load * 1000),
        voltage,
        current,
        remaining,
        0,
        0 if health is None else health.i2c_errors or 0,
        0,
        0,
        0,
        0,
    )


def battery_status(at: Moment) -> Message:
    """BATTERY_STATUS: mV, the same for each cell (Mission Planner adds them up), cA and mAh."""
    charge = at.fresh(v.Charge)
    voltage, current, remaining = _battery(at)
    if voltage == _UNKNOWN_U16:
        raise Unknown
    power = at.need(v.Power)
    cells = power.cells if power.cells and power.cells <= _MOST_CELLS else 1
    least, more = divmod(voltage, cells)
    voltages = [least + (cell < more) for cell in range(cells)]
    voltages += [_UNKNOWN_U16] * (_MOST_CELLS - cells)
    return messages.MAVLink_battery_status_message(
        0, 0, 0, 32767, voltages, current, -1 if charge is None else charge.drawn_mah, -1, remaining
    )


def _battery(at: Moment) -> tuple[int, int, int]:
    """mV, cA and percent."""
    power = at.fresh(v.Power)
    if power is None:
        return _UNKNOWN_U16, -1, -1
    return (
        _scaled_u16(power.voltage_v, 1000),
        -1 if power.current_a is None else _fit(round(power.current_a * 100), 16),
        -1 if power.remaining_percent is None else power.remaining_percent,
    )


def rc_channels(at: Moment) -> Message:
    """RC_CHANNELS: microseconds."""
    channels, signal = at.need(v.Sticks).channels_us, at.fresh(v.Signal)
    # As ArduPilot: Mission Planner would show UINT16_MAX, "unused", as a pulse width.
    fields = (*channels, *[0] * _CHANNELS)[:_CHANNELS]
    rssi = _UNKNOWN_U8 if signal is None else int(signal.strength * _MAX_RSSI)
    return messages.MAVLink_rc_channels_message(at.boot_ms, len(channels), *fields, rssi)


def attitude_quaternion(at: Moment) -> Message:
    """ATTITUDE_QUATERNION: w, x, y, z."""
    now = at.need(v.Orientation)
    halves = [math.radians(angle) / 2 for angle in (now.roll_deg, now.pitch_deg, now.heading_deg)]
    (sin_r, sin_p, sin_y), (cos_r, cos_p, cos_y) = map(math.sin, halves), map(math.cos, halves)
    return messages.MAVLink_attitude_quaternion_message(
        at.boot_ms,
        cos_r * cos_p * cos_y + sin_r * sin_p * sin_y,
        sin_r * cos_p * cos_y - cos_r * sin_p * sin_y,
        cos_r * sin_p * cos_y + sin_r * cos_p * sin_y,
        cos_r * cos_p * sin_y - sin_r * sin_p * cos_y,
        *_UNKNOWN_RATES,
    )


def local_position_ned(at: Moment) -> Message:
    """LOCAL_POSITION_NED: metres from home, m/s."""
    position, height = at.need(v.GlobalPosition), at.need(v.Height)
    north, east = north_east_m(known(at.vehicle.home), position)
    return messages.MAVLink_local_position_ned_message(
        at.boot_ms,
        north,
        east,
        -height.height_m,
        known(position.north_m_s),
        known(position.east_m_s),
        -height.climb_m_s,
    )


def nav_controller_output(at: Moment) -> Message:
    """NAV_CONTROLLER_OUTPUT: the way to the waypoint, or home; degrees and metres. The set points are unknown.

    The way is the board's own, if it reports that.
    """
    state, height = at.vehicle.last(v.FlightState), at.fresh(v.Height)
    position, now = at.need(v.GlobalPosition), at.need(v.Orientation)
    if state is None or not state.armed:
        raise Unknown
    flight = at.vehicle.mission_flight(at.now)
    if flight is not None and flight.way is not None:
        return _nav_controller_output(now, flight.way)
    mission = at.mission()
    item = mission.items[mission.seq] if 0 < mission.seq < len(mission.items) else None
    climb_m = 0.0
    if item is not None and item.lat_e7 and item.lon_e7:
        target = Home(item.lat_e7, item.lon_e7)
        climb_m = 0.0 if height is None else item.alt_m - height.height_m
    elif at.vehicle.flight_mode is FlightMode.RTL or (
        item is not None and item.command == Command.NAV_RETURN_TO_LAUNCH
    ):
        target = known(at.vehicle.home)
    else:
        raise Unknown
    return _nav_controller_output(now, Way(distance_m(position, target), bearing_deg(position, target), climb_m))


def _nav_controller_output(now: v.Orientation, way: Way) -> Message:
    bearing = round((way.bearing_deg + 180) % 360 - 180)
    distance = min(round(way.distance_m), _UNKNOWN_U16)
    return messages.MAVLink_nav_controller_output_message(
        now.roll_deg, now.pitch_deg, bearing, bearing, distance, way.climb_m, 0.0, 0.0
    )


def system_time(at: Moment) -> Message:
    """SYSTEM_TIME: the Pi's clock."""
    return messages.MAVLink_system_time_message(round(known(at.unix_time_s(at.now)) * 1e6), at.boot_ms)


def extended_sys_state(at: Moment) -> Message:
    """EXTENDED_SYS_STATE: on the ground while disarmed. Armed as a mission flight reports, or by height and speed."""
    landed_state = int(messages.MAV_LANDED_STATE_UNDEFINED)
    if not at.readiness.is_lost:
        known(at.need(v.FlightState).armed)
        landed_state = _landed_state(at)
    return messages.MAVLink_extended_sys_state_message(messages.MAV_VTOL_STATE_UNDEFINED, landed_state)


def _landed_state(at: Moment) -> int:
    """MAV_LANDED_STATE; undefined while armed without a height."""
    if not at.vehicle.armed:
        return int(messages.MAV_LANDED_STATE_ON_GROUND)
    flight = at.vehicle.mission_flight(at.now) if at.vehicle.last(v.MissionLeg) else None  # most boards report none
    if flight is not None and flight.stage is not None:
        return flight.stage
    height, gps = at.fresh(v.Height), at.fresh(v.GpsFix)
    if height is None:
        return int(messages.MAV_LANDED_STATE_UNDEFINED)
    speed = None if gps is None else gps.ground_speed_m_s
    if abs(height.height_m) > _FLYING_M or abs(height.climb_m_s) > _FLYING_M_S or (speed or 0) > _FLYING_M_S:
        return int(messages.MAV_LANDED_STATE_IN_AIR)
    return int(messages.MAV_LANDED_STATE_ON_GROUND)


def home_position(at: Moment) -> Message:
    """HOME_POSITION: degrees * 1e7, mm above mean sea level. The local frame has its origin there."""
    home = known(at.vehicle.home)
    altitude_mm = _fit(round(known(home.altitude_m) * 1000), 32)
    place = (home.lat_e7, home.lon_e7, altitude_mm)
    unknown_attitude, unknown_approach = [math.nan] * 4, (math.nan, math.nan, math.nan)
    return messages.MAVLink_home_position_message(*place, 0.0, 0.0, 0.0, unknown_attitude, *unknown_approach)


def _scaled_u16(value: float | None, parts: int) -> int:
    return _UNKNOWN_U16 if value is None else min(max(round(value * parts), 0), _UNKNOWN_U16)


def _fit(value: int, bits: int) -> int:
    """Clamp a value to a signed field: a damaged reply may hold any number."""
    limit = 1 << bits - 1
    return min(max(value, -limit), limit - 1)
