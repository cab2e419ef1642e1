# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink messages that make a flight controller on MSP a vehicle: docs/telemetry.md, field by field.

What is not known is MAVLink's "unknown"; a message whose fields have no such value is not made (None).
"""

import math

from bridge.model.flight_mode import FlightMode
from bridge.model.mission_progress import Progress
from bridge.model.vehicle_state import VehicleState
from protocols.mavlink.dialect import Message, messages
from protocols.msp.telemetry import Sensor

#: MultiWii's MULTITYPE (Harakiri: mw.h) -> MAV_TYPE. Ground stations choose their screens by it; the rest are copters.
_TYPES = {
    1: messages.MAV_TYPE_TRICOPTER,
    6: messages.MAV_TYPE_HEXAROTOR,
    7: messages.MAV_TYPE_HEXAROTOR,
    8: messages.MAV_TYPE_FIXED_WING,
    10: messages.MAV_TYPE_HEXAROTOR,
    11: messages.MAV_TYPE_OCTOROTOR,
    12: messages.MAV_TYPE_OCTOROTOR,
    13: messages.MAV_TYPE_OCTOROTOR,
    14: messages.MAV_TYPE_FIXED_WING,
    15: messages.MAV_TYPE_HELICOPTER,
    16: messages.MAV_TYPE_HELICOPTER,
    18: messages.MAV_TYPE_HEXAROTOR,
}
#: custom_mode of ArduCopter, and of ArduPlane for what has wings: there is no name for a hold of the height alone.
_COPTER_MODES = {
    FlightMode.STABILIZE: 0,
    FlightMode.ACRO: 1,
    FlightMode.ALT_HOLD: 2,
    FlightMode.AUTO: 3,
    FlightMode.LOITER: 5,
    FlightMode.RTL: 6,
}
_PLANE_MODES = {
    FlightMode.STABILIZE: 2,
    FlightMode.ACRO: 4,
    FlightMode.ALT_HOLD: 6,
    FlightMode.AUTO: 10,
    FlightMode.LOITER: 12,
    FlightMode.RTL: 11,
}
_SENSORS = {
    Sensor.ACCELEROMETER: messages.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
    Sensor.BAROMETER: messages.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    Sensor.COMPASS: messages.MAV_SYS_STATUS_SENSOR_3D_MAG,
    Sensor.GPS: messages.MAV_SYS_STATUS_SENSOR_GPS,
    Sensor.SONAR: messages.MAV_SYS_STATUS_SENSOR_LASER_POSITION,
}
#: Without motor outputs Mission Planner shows a safety switch that is on.
_ALWAYS_THERE = messages.MAV_SYS_STATUS_SENSOR_3D_GYRO | messages.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
#: There is no fence, but without this bit MAVProxy says "fence breach".
_NEVER_ILL = messages.MAV_SYS_STATUS_GEOFENCE

_CAPABILITIES = (
    messages.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | messages.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | messages.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | messages.MAV_PROTOCOL_CAPABILITY_MAVLINK2
)
_NO_MISSION = 1
_NO_TOTAL = 0xFFFF
_VERSION = (0, 1, 0, 0)
_UNKNOWN_U16 = 0xFFFF
_UNKNOWN_U8 = 0xFF
_RAW_CHANNELS, _CHANNELS = 8, 18
_MAX_RSSI, _MSP_MAX_RSSI = 254, 1020
_STICK_LOW_US, _STICK_HIGH_US = 1000, 2000


def vehicle_type(vehicle: VehicleState) -> int:
    """Return MAV_TYPE; a mixer that nobody told of is a quadrocopter's."""
    kind: int = _TYPES.get(vehicle.mixer or 0, messages.MAV_TYPE_QUADROTOR)
    return kind


def heartbeat(vehicle: VehicleState, *, linked: bool) -> Message:
    """HEARTBEAT: an ArduPilot copter (or plane); the state says whether a flight controller is there."""
    kind = vehicle_type(vehicle)
    modes = _PLANE_MODES if kind == messages.MAV_TYPE_FIXED_WING else _COPTER_MODES
    mode = vehicle.mode or FlightMode.STABILIZE
    base_mode = messages.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if mode is not FlightMode.ACRO:
        base_mode |= messages.MAV_MODE_FLAG_STABILIZE_ENABLED
    if mode in (FlightMode.LOITER, FlightMode.RTL, FlightMode.AUTO):
        base_mode |= messages.MAV_MODE_FLAG_GUIDED_ENABLED
    if vehicle.armed:
        base_mode |= messages.MAV_MODE_FLAG_SAFETY_ARMED
    if not linked:
        state = messages.MAV_STATE_UNINIT
    else:
        state = messages.MAV_STATE_ACTIVE if vehicle.armed else messages.MAV_STATE_STANDBY
    return messages.MAVLink_heartbeat_message(
        kind, messages.MAV_AUTOPILOT_ARDUPILOTMEGA, base_mode, modes[mode], state, 3
    )


def autopilot_version() -> Message:
    """AUTOPILOT_VERSION. No FTP capability: Mission Planner would wait 15 s for files."""
    version = int.from_bytes(bytes(_VERSION), "big")
    no_hash = [0] * 8
    return messages.MAVLink_autopilot_version_message(
        _CAPABILITIES, version, 0, 0, 0, no_hash, no_hash, no_hash, 0, 0, 0
    )


def mission_current(count: int, seq: int = 0, progress: Progress = Progress.NOT_STARTED) -> Message:
    """MISSION_CURRENT: `count` items are held (home included), item `seq` is flown to."""
    if not count:
        return messages.MAVLink_mission_current_message(0, _NO_TOTAL, _NO_MISSION, 0)
    return messages.MAVLink_mission_current_message(seq, count - 1, progress.value, 0)


def mission_item_reached(seq: int) -> Message:
    """MISSION_ITEM_REACHED."""
    return messages.MAVLink_mission_item_reached_message(seq)


def attitude(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """ATTITUDE, radians; MSP's pitch is nose-down positive, MAVLink's nose-up. Rates are not known."""
    now = vehicle.attitude
    if now is None:
        return None
    return messages.MAVLink_attitude_message(
        boot_ms,
        math.radians(now.roll_ddeg / 10),
        math.radians(-now.pitch_ddeg / 10),
        math.radians((now.heading_deg + 180) % 360 - 180),
        math.nan,
        math.nan,
        math.nan,
    )


def gps_raw_int(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """GPS_RAW_INT: degrees * 1e7, mm above sea level, cm/s; dilution and course only where they are sent."""
    gps = vehicle.gps
    if gps is None:
        return None
    return messages.MAVLink_gps_raw_int_message(
        boot_ms * 1000,
        vehicle.fix,
        gps.lat_e7,
        gps.lon_e7,
        gps.altitude_m * 1000,
        _UNKNOWN_U16 if gps.hdop_e2 is None else gps.hdop_e2,
        _UNKNOWN_U16,
        gps.speed_cms,
        _UNKNOWN_U16 if gps.course_ddeg is None else gps.course_ddeg * 10 % 36000,
        gps.satellites,
    )


def global_position_int(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """GLOBAL_POSITION_INT: mm, cm/s, 0.01 degrees. Only with a fix, a velocity and a height: none has an "unknown"."""
    gps, height, velocity = vehicle.gps, vehicle.height, vehicle.velocity
    if gps is None or not vehicle.has_fix or height is None or velocity is None:
        return None
    north, east = velocity
    heading = vehicle.attitude if vehicle.has_compass else None
    return messages.MAVLink_global_position_int_message(
        boot_ms,
        gps.lat_e7,
        gps.lon_e7,
        gps.altitude_m * 1000,
        _fit(height.height_cm * 10, 32),
        _fit(round(north * 100), 16),
        _fit(round(east * 100), 16),
        _fit(-height.climb_cms, 16),
        _UNKNOWN_U16 if heading is None else heading.heading_deg % 360 * 100,
    )


def vfr_hud(vehicle: VehicleState, _boot_ms: int) -> Message | None:
    """VFR_HUD: m/s, degrees, percent of the throttle stick, metres above sea level.

    A copter's airspeed is the ground speed, as with ArduCopter; of what has wings it is not known. Heading and throttle
    have no "unknown", so both must be there.
    """
    attitude_now, channels, height = vehicle.attitude, vehicle.channels, vehicle.height
    if attitude_now is None or channels is None:
        return None
    gps = vehicle.gps if vehicle.has_fix else None
    speed = math.nan if gps is None else gps.speed_cms / 100
    has_wings = vehicle_type(vehicle) == messages.MAV_TYPE_FIXED_WING
    throttle = (channels[3] - _STICK_LOW_US) * 100 // (_STICK_HIGH_US - _STICK_LOW_US)
    return messages.MAVLink_vfr_hud_message(
        math.nan if has_wings else speed,
        speed,
        attitude_now.heading_deg % 360,
        min(max(throttle, 0), 100),
        math.nan if gps is None else gps.altitude_m,
        math.nan if height is None else height.climb_cms / 100,
    )


def sys_status(vehicle: VehicleState, _boot_ms: int) -> Message | None:
    """SYS_STATUS: what STATUS calls there is there, and well; mV and cA; the I2C errors are the errors_comm."""
    status = vehicle.status
    if status is None:
        return None
    sensors = _ALWAYS_THERE
    for sensor, bit in _SENSORS.items():
        if sensor & status.sensors:
            sensors |= bit
    millivolts, centiamperes, _ = _battery(vehicle)
    return messages.MAVLink_sys_status_message(
        sensors, sensors, sensors | _NEVER_ILL, 0, millivolts, centiamperes, -1, 0, status.i2c_errors, 0, 0, 0, 0
    )


def battery_status(vehicle: VehicleState, _boot_ms: int) -> Message | None:
    """BATTERY_STATUS: mV (which Mission Planner reads only here), cA and mAh where they are measured."""
    millivolts, centiamperes, drawn_mah = _battery(vehicle)
    if millivolts == _UNKNOWN_U16:
        return None
    voltages = [millivolts, *[_UNKNOWN_U16] * 9]
    return messages.MAVLink_battery_status_message(0, 0, 0, 32767, voltages, centiamperes, drawn_mah, -1, -1)


def rc_channels(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """RC_CHANNELS: microseconds, in ArduPilot's order."""
    if vehicle.channels is None:
        return None
    channels = _in_mavlink_order(vehicle.channels)
    unknown = [_UNKNOWN_U16] * (_CHANNELS - len(channels))
    return messages.MAVLink_rc_channels_message(boot_ms, len(channels), *channels, *unknown, _rssi(vehicle))


def rc_channels_raw(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """RC_CHANNELS_RAW: the first eight."""
    if vehicle.channels is None:
        return None
    channels = _in_mavlink_order(vehicle.channels)[:_RAW_CHANNELS]
    unknown = [_UNKNOWN_U16] * (_RAW_CHANNELS - len(channels))
    return messages.MAVLink_rc_channels_raw_message(boot_ms, 0, *channels, *unknown, _rssi(vehicle))


def raw_imu(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """RAW_IMU: as the flight controller scales them."""
    imu = vehicle.imu
    if imu is None:
        return None
    return messages.MAVLink_raw_imu_message(boot_ms * 1000, *imu.acc, *imu.gyro, *imu.mag)


def extended_sys_state(vehicle: VehicleState, _boot_ms: int) -> Message | None:
    """EXTENDED_SYS_STATE: disarmed is on the ground; of an armed craft it is not known."""
    if vehicle.armed is None:
        return None
    landed = messages.MAV_LANDED_STATE_UNDEFINED if vehicle.armed else messages.MAV_LANDED_STATE_ON_GROUND
    return messages.MAVLink_extended_sys_state_message(messages.MAV_VTOL_STATE_UNDEFINED, landed)


def cycle_time(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """NAMED_VALUE_INT: the main loop's time in microseconds."""
    return vehicle.status and messages.MAVLink_named_value_int_message(
        boot_ms, b"cycle_us", vehicle.status.cycle_time_us
    )


def i2c_errors(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """NAMED_VALUE_INT: failed talks with a sensor since the flight controller's start."""
    return vehicle.status and messages.MAVLink_named_value_int_message(boot_ms, b"i2c_err", vehicle.status.i2c_errors)


def home_distance(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """NAMED_VALUE_FLOAT: metres to the flight controller's home."""
    if vehicle.home is None or vehicle.home_vector is None:
        return None
    return messages.MAVLink_named_value_float_message(boot_ms, b"home_m", vehicle.home_vector.distance_m)


def home_direction(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """NAMED_VALUE_FLOAT: where the flight controller's home is, degrees."""
    if vehicle.home is None or vehicle.home_vector is None:
        return None
    return messages.MAVLink_named_value_float_message(boot_ms, b"home_deg", vehicle.home_vector.direction_deg % 360)


def home_position(vehicle: VehicleState, _boot_ms: int) -> Message | None:
    """HOME_POSITION: degrees * 1e7, mm above sea level; the local frame has its origin there."""
    home, altitude_m = vehicle.home_or_position(), vehicle.home_altitude_m
    if home is None or altitude_m is None:
        return None
    altitude_mm = _fit(round(altitude_m * 1000), 32)
    unknown_attitude, unknown_approach = [math.nan] * 4, [math.nan] * 3
    return messages.MAVLink_home_position_message(
        *home, altitude_mm, 0.0, 0.0, 0.0, unknown_attitude, *unknown_approach
    )


def _battery(vehicle: VehicleState) -> tuple[int, int, int]:
    """Return mV, cA and mAh. A voltage of 0 is not measured, nor is a current when nothing was ever drawn."""
    analog = vehicle.analog
    if analog is None:
        return _UNKNOWN_U16, -1, -1
    millivolts = analog.battery_dv * 100 or _UNKNOWN_U16
    if analog.current_ca is None or analog.drawn_mah is None or not (analog.current_ca or analog.drawn_mah):
        return millivolts, -1, -1
    return millivolts, analog.current_ca, analog.drawn_mah


def _in_mavlink_order(channels: tuple[int, ...]) -> tuple[int, ...]:
    """MSP sends roll, pitch, yaw, throttle; ground stations expect roll, pitch, throttle, yaw."""
    roll, pitch, yaw, throttle, *aux = channels
    return (roll, pitch, throttle, yaw, *aux)


def _rssi(vehicle: VehicleState) -> int:
    """Return 0..254, or 255: not known."""
    if vehicle.analog is None or not vehicle.measures_rssi:
        return _UNKNOWN_U8
    return min(vehicle.analog.rssi * _MAX_RSSI // _MSP_MAX_RSSI, _MAX_RSSI)


def _fit(value: int, bits: int) -> int:
    """Keep a value within a signed field: a damaged reply may say anything."""
    limit = 1 << bits - 1
    return min(max(value, -limit), limit - 1)
