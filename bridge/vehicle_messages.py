"""The MAVLink messages that make a flight controller on MSP a vehicle; unknown values are MAVLink's "unknown"."""

import math

from bridge.vehicle_state import VehicleState
from protocols.mavlink.dialect import Message, messages

#: MultiWii's MULTITYPE (Harakiri: mw.h) -> MAV_TYPE. Ground stations choose their copter screens by it.
_TYPES = {
    1: messages.MAV_TYPE_TRICOPTER,
    2: messages.MAV_TYPE_QUADROTOR,
    3: messages.MAV_TYPE_QUADROTOR,
    6: messages.MAV_TYPE_HEXAROTOR,
    7: messages.MAV_TYPE_HEXAROTOR,
    8: messages.MAV_TYPE_FIXED_WING,
    9: messages.MAV_TYPE_QUADROTOR,
    10: messages.MAV_TYPE_HEXAROTOR,
    11: messages.MAV_TYPE_OCTOROTOR,
    12: messages.MAV_TYPE_OCTOROTOR,
    13: messages.MAV_TYPE_OCTOROTOR,
    14: messages.MAV_TYPE_QUADROTOR,
    15: messages.MAV_TYPE_HEXAROTOR,
}
_CAPABILITIES = (
    messages.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
    | messages.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | messages.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | messages.MAV_PROTOCOL_CAPABILITY_MAVLINK2
)
_NO_MISSION, _NOT_STARTED = 1, 2
_NO_TOTAL = 0xFFFF
_VERSION = (0, 1, 0, 0)


def heartbeat(vehicle: VehicleState, *, linked: bool) -> Message:
    """HEARTBEAT: an ArduPilot copter; the state says whether a flight controller is there."""
    vehicle_type = _TYPES.get(vehicle.mixer or 3, messages.MAV_TYPE_QUADROTOR)
    base_mode = messages.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | messages.MAV_MODE_FLAG_STABILIZE_ENABLED
    base_mode |= messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if vehicle.armed:
        base_mode |= messages.MAV_MODE_FLAG_SAFETY_ARMED
    if not linked:
        state = messages.MAV_STATE_UNINIT
    else:
        state = messages.MAV_STATE_ACTIVE if vehicle.armed else messages.MAV_STATE_STANDBY
    return messages.MAVLink_heartbeat_message(
        vehicle_type, messages.MAV_AUTOPILOT_ARDUPILOTMEGA, base_mode, 0, state, 3
    )


def autopilot_version() -> Message:
    """AUTOPILOT_VERSION. No FTP capability: Mission Planner would wait 15 s for files."""
    version = int.from_bytes(bytes(_VERSION), "big")
    no_hash = [0] * 8
    return messages.MAVLink_autopilot_version_message(
        _CAPABILITIES, version, 0, 0, 0, no_hash, no_hash, no_hash, 0, 0, 0
    )


def mission_current(count: int) -> Message:
    """MISSION_CURRENT: `count` records are held (home included); nothing flies them from here."""
    if not count:
        return messages.MAVLink_mission_current_message(0, _NO_TOTAL, _NO_MISSION, 0)
    return messages.MAVLink_mission_current_message(0, count - 1, _NOT_STARTED, 0)


def attitude(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """ATTITUDE, radians; Harakiri's pitch is nose-down positive, MAVLink's nose-up."""
    now = vehicle.attitude
    if now is None:
        return None
    return messages.MAVLink_attitude_message(
        boot_ms,
        math.radians(now.roll_ddeg / 10),
        math.radians(-now.pitch_ddeg / 10),
        math.radians(now.heading_deg),
        math.nan,
        math.nan,
        math.nan,
    )


def gps_raw_int(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """GPS_RAW_INT: degrees * 1e7, mm above sea level, cm/s; dilution and course unknown on Harakiri."""
    gps = vehicle.gps
    if gps is None:
        return None
    fix = messages.GPS_FIX_TYPE_3D_FIX if gps.has_fix else messages.GPS_FIX_TYPE_NO_FIX
    course_cdeg = 65535 if gps.course_ddeg is None else gps.course_ddeg * 10 % 36000
    return messages.MAVLink_gps_raw_int_message(
        boot_ms * 1000,
        fix,
        gps.lat_e7,
        gps.lon_e7,
        gps.altitude_m * 1000,
        65535,
        65535,
        gps.speed_cms,
        course_cdeg,
        gps.satellites,
    )


def global_position_int(vehicle: VehicleState, boot_ms: int) -> Message | None:
    """GLOBAL_POSITION_INT, only with a fix: mm, height above launch from the barometer, heading in 0.01 degrees."""
    gps, height = vehicle.gps, vehicle.altitude
    if gps is None or not gps.has_fix:
        return None
    heading_cdeg = 65535 if vehicle.attitude is None else vehicle.attitude.heading_deg % 360 * 100
    return messages.MAVLink_global_position_int_message(
        boot_ms,
        gps.lat_e7,
        gps.lon_e7,
        gps.altitude_m * 1000,
        0 if height is None else _fit(height.height_cm * 10, 32),
        0,
        0,
        0 if height is None else _fit(-height.climb_cms, 16),
        heading_cdeg,
    )


def _fit(value: int, bits: int) -> int:
    """Keep a value within a signed field: a damaged reply may say anything."""
    limit = 1 << bits - 1
    return min(max(value, -limit), limit - 1)


def sys_status(vehicle: VehicleState) -> Message | None:
    """SYS_STATUS: battery in mV; current, charge and load unknown."""
    if vehicle.analog is None:
        return None
    voltage_mv = vehicle.analog.battery_dv * 100
    return messages.MAVLink_sys_status_message(0, 0, 0, 0, voltage_mv, -1, -1, 0, 0, 0, 0, 0, 0)


def battery_status(vehicle: VehicleState) -> Message | None:
    """BATTERY_STATUS: the voltage in mV, which Mission Planner reads only here; all else unknown."""
    if vehicle.analog is None:
        return None
    voltages_mv = [vehicle.analog.battery_dv * 100, *[65535] * 9]
    return messages.MAVLink_battery_status_message(0, 0, 0, 32767, voltages_mv, -1, -1, -1, -1)


def home_position(home: tuple[int, int] | None) -> Message | None:
    """HOME_POSITION: degrees * 1e7; the height of the launch point is not known to an MSP flight controller."""
    if home is None:
        return None
    lat_e7, lon_e7 = home
    unknown_attitude = [math.nan] * 4
    return messages.MAVLink_home_position_message(
        lat_e7, lon_e7, 0, 0.0, 0.0, 0.0, unknown_attitude, math.nan, math.nan, math.nan
    )
