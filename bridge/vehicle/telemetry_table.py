# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of telemetry messages: their reading, default interval and ArduPilot stream."""

from dataclasses import dataclass
from math import inf

from bridge.model import vehicle as v
from bridge.vehicle import vehicle_messages as make
from protocols.mavlink.dialect import messages as m

NO_STREAM = -1
#: MAV_DATA_STREAM's members, as ArduCopter fills them (GCS_Mavlink.cpp).
EXTENDED_STATUS, RC_CHANNELS, POSITION = 2, 3, 6
EXTRA1, EXTRA2, EXTRA3 = 10, 11, 12


@dataclass(frozen=True, slots=True)
class Row:
    """One message. It is sent as soon as `reading` is heard, or `other` while that is stale, or by the clock if None.

    `interval_s`: the default; infinite: only on request.
    """

    msgid: int
    reading: type[v.Reading] | None
    interval_s: float
    stream: int
    maker: make.Maker
    other: type[v.Reading] | None = None

    @property
    def readings(self) -> tuple[type[v.Reading] | None, ...]:
        return (self.reading,) if self.other is None else (self.reading, self.other)


TELEMETRY = (
    Row(m.MAVLINK_MSG_ID_ATTITUDE, v.Orientation, 0.1, EXTRA1, make.attitude),
    Row(m.MAVLINK_MSG_ID_GPS_RAW_INT, v.GpsFix, 0.2, EXTENDED_STATUS, make.gps_raw_int),
    Row(m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, v.GlobalPosition, 0.2, POSITION, make.global_position_int, v.Height),
    Row(m.MAVLINK_MSG_ID_VFR_HUD, v.Height, 0.2, EXTRA2, make.vfr_hud, v.GpsFix),
    Row(m.MAVLINK_MSG_ID_SYS_STATUS, v.Health, 0.5, EXTENDED_STATUS, make.sys_status, v.Power),
    Row(m.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, v.FlightState, 1.0, EXTENDED_STATUS, make.extended_sys_state),
    Row(m.MAVLINK_MSG_ID_BATTERY_STATUS, v.Power, 0.5, EXTRA3, make.battery_status),
    Row(m.MAVLINK_MSG_ID_RC_CHANNELS, v.Sticks, 0.5, RC_CHANNELS, make.rc_channels),
    Row(m.MAVLINK_MSG_ID_HOME_POSITION, v.GlobalPosition, inf, NO_STREAM, make.home_position),
    Row(m.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, v.Orientation, inf, NO_STREAM, make.attitude_quaternion),
    Row(m.MAVLINK_MSG_ID_LOCAL_POSITION_NED, v.GlobalPosition, inf, POSITION, make.local_position_ned),
    Row(m.MAVLINK_MSG_ID_MISSION_CURRENT, None, 1.0, EXTENDED_STATUS, make.mission_current),
    Row(m.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, None, 1.0, EXTENDED_STATUS, make.nav_controller_output),
    Row(m.MAVLINK_MSG_ID_SYSTEM_TIME, None, 1.0, EXTRA3, make.system_time),
)
