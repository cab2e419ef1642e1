# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle's groups from the MAVLink of a flight controller that speaks for itself.

Thousands of frames may come in a second, and mostly nobody looks: the newest of each kind is kept as bytes and decoded
when somebody does.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from bridge.model.vehicle_groups import Attitude, Battery, Gps, Group, Position, Rc, Status
from protocols.mavlink.codec import MavlinkDecoder
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame

_TOLD_BY: dict[int, frozenset[Group]] = {
    m.MAVLINK_MSG_ID_HEARTBEAT: frozenset({Group.STATUS}),
    m.MAVLINK_MSG_ID_ATTITUDE: frozenset({Group.ATTITUDE}),
    m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: frozenset({Group.POSITION}),
    m.MAVLINK_MSG_ID_GPS_RAW_INT: frozenset({Group.GPS}),
    m.MAVLINK_MSG_ID_SYS_STATUS: frozenset({Group.BATTERY}),
    m.MAVLINK_MSG_ID_BATTERY_STATUS: frozenset(),
    m.MAVLINK_MSG_ID_RC_CHANNELS: frozenset({Group.RC}),
    m.MAVLINK_MSG_ID_RC_CHANNELS_RAW: frozenset({Group.RC}),
    m.MAVLINK_MSG_ID_VFR_HUD: frozenset(),
    m.MAVLINK_MSG_ID_HOME_POSITION: frozenset(),
}
#: Harakiri has no GLOBAL_POSITION_INT.
_TOLD_BY_HARAKIRI = _TOLD_BY | {m.MAVLINK_MSG_ID_GPS_RAW_INT: frozenset({Group.GPS, Group.POSITION})}
#: Where a heartbeat says what kind of autopilot sends it. Cameras and gimbals are none.
_AUTOPILOT_AT = 5
_UNKNOWN_U16 = 0xFFFF
_UNKNOWN_U8 = 0xFF
_MAX_RSSI = 254
_CHANNELS = 18
_SENSORS = {
    m.MAV_SYS_STATUS_SENSOR_3D_ACCEL: "accelerometer",
    m.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: "barometer",
    m.MAV_SYS_STATUS_SENSOR_3D_MAG: "compass",
    m.MAV_SYS_STATUS_SENSOR_GPS: "gps",
    m.MAV_SYS_STATUS_SENSOR_LASER_POSITION: "sonar",
}
_FIXES = {m.GPS_FIX_TYPE_NO_GPS: None, m.GPS_FIX_TYPE_NO_FIX: "none", m.GPS_FIX_TYPE_2D_FIX: "2D"}


class MavlinkGroups:
    """Keeps what one autopilot sends. `fresh`: groups that there is news of, if `is_watched`.

    A Harakiri's VFR_HUD has the height above the launch where MAVLink wants that above the sea.
    """

    def __init__(self, fresh: set[Group], *, is_harakiri: bool) -> None:
        self._fresh = fresh
        self._is_harakiri = is_harakiri
        self._decoder = MavlinkDecoder()
        self._newest: dict[int, MavlinkFrame] = {}
        #: By the bytes of a frame's header that hold sender and message id.
        self._told_by: dict[bytes, tuple[int, frozenset[Group]]] = {}
        self.is_watched = False

    def take(self, frames: Sequence[MavlinkFrame]) -> None:
        """Keep frames. The first autopilot that is heard is the one."""
        if not self._told_by:
            self._recognise(frames)
        told_by, newest = self._told_by, self._newest
        for frame in frames:
            raw = frame.raw
            known = told_by.get(raw[5:10] if raw[0] == MAGIC_V2 else raw[3:6])
            if known is not None:
                msgid, groups = known
                newest[msgid] = frame
                if self.is_watched:
                    self._fresh |= groups

    def _recognise(self, frames: Sequence[MavlinkFrame]) -> None:
        for frame in frames:
            if frame.msgid == m.MAVLINK_MSG_ID_HEARTBEAT and frame.payload[_AUTOPILOT_AT] != m.MAV_AUTOPILOT_INVALID:
                sender = bytes((frame.sysid, frame.compid))
                table = _TOLD_BY_HARAKIRI if self._is_harakiri else _TOLD_BY
                for msgid, groups in table.items():
                    self._told_by[sender + msgid.to_bytes(3, "little")] = msgid, groups
                    self._told_by[sender + bytes((msgid,))] = msgid, groups
                return

    def attitude(self) -> Attitude:
        """ATTITUDE."""
        now = self._message(m.MAVLINK_MSG_ID_ATTITUDE)
        if now is None:
            return Attitude()
        heading = _degrees(now.yaw)
        return Attitude(_degrees(now.roll), _degrees(now.pitch), None if heading is None else heading % 360)

    def position(self) -> Position:
        """GLOBAL_POSITION_INT, else GPS_RAW_INT and VFR_HUD; HOME_POSITION if the autopilot sends it."""
        now = self._message(m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
        home = self._message(m.MAVLINK_MSG_ID_HOME_POSITION)
        home_lat, home_lon = (None, None) if home is None else (home.latitude / 1e7, home.longitude / 1e7)
        if now is None:
            return replace(self._raw_position(), home_lat_deg=home_lat, home_lon_deg=home_lon)
        if not (now.lat or now.lon):
            return Position(home_lat_deg=home_lat, home_lon_deg=home_lon)
        return Position(
            lat_deg=now.lat / 1e7,
            lon_deg=now.lon / 1e7,
            altitude_m=now.alt / 1000,
            height_m=now.relative_alt / 1000,
            climb_m_s=-now.vz / 100,
            north_m_s=now.vx / 100,
            east_m_s=now.vy / 100,
            home_lat_deg=home_lat,
            home_lon_deg=home_lon,
        )

    def _raw_position(self) -> Position:
        raw, hud = self._message(m.MAVLINK_MSG_ID_GPS_RAW_INT), self._message(m.MAVLINK_MSG_ID_VFR_HUD)
        if raw is not None and raw.fix_type < m.GPS_FIX_TYPE_2D_FIX:
            raw = None
        return Position(
            lat_deg=None if raw is None else raw.lat / 1e7,
            lon_deg=None if raw is None else raw.lon / 1e7,
            altitude_m=None if raw is None else raw.alt / 1000,
            height_m=_finite(hud.alt) if hud is not None and self._is_harakiri else None,
            climb_m_s=None if hud is None else _finite(hud.climb),
        )

    def gps(self) -> Gps:
        """GPS_RAW_INT."""
        now = self._message(m.MAVLINK_MSG_ID_GPS_RAW_INT)
        if now is None:
            return Gps()
        return Gps(
            fix=_FIXES.get(now.fix_type, "3D"),
            satellites=_known(now.satellites_visible, _UNKNOWN_U8),
            hdop=_scaled(now.eph, 100),
            ground_speed_m_s=_scaled(now.vel, 100),
            course_deg=_scaled(now.cog, 100),
        )

    def battery(self) -> Battery:
        """SYS_STATUS; what was drawn is in BATTERY_STATUS."""
        now = self._message(m.MAVLINK_MSG_ID_SYS_STATUS)
        if now is None:
            return Battery()
        more = self._message(m.MAVLINK_MSG_ID_BATTERY_STATUS)
        return Battery(
            voltage_v=_scaled(now.voltage_battery, 1000) or None,
            current_a=None if now.current_battery < 0 else now.current_battery / 100,
            drawn_mah=None if more is None or more.current_consumed < 0 else more.current_consumed,
        )

    def rc(self) -> Rc:
        """RC_CHANNELS, else RC_CHANNELS_RAW."""
        now = self._message(m.MAVLINK_MSG_ID_RC_CHANNELS) or self._message(m.MAVLINK_MSG_ID_RC_CHANNELS_RAW)
        if now is None:
            return Rc()
        values = (getattr(now, f"chan{number}_raw", _UNKNOWN_U16) for number in range(1, _CHANNELS + 1))
        rssi = _known(now.rssi, _UNKNOWN_U8)
        return Rc(
            tuple(value for value in values if value not in (0, _UNKNOWN_U16)) or None,
            None if rssi is None else round(rssi / _MAX_RSSI * 100, 1),
        )

    def status(self) -> Status:
        """HEARTBEAT; the sensors are in SYS_STATUS. A mode's number means something to its autopilot only."""
        heartbeat, status = self._message(m.MAVLINK_MSG_ID_HEARTBEAT), self._message(m.MAVLINK_MSG_ID_SYS_STATUS)
        if heartbeat is None:
            return Status()
        sensors = None
        if status is not None:
            well = status.onboard_control_sensors_present & status.onboard_control_sensors_health
            sensors = tuple(name for bit, name in _SENSORS.items() if bit & well)
        return Status(
            armed=bool(heartbeat.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED),
            mode=str(heartbeat.custom_mode) if heartbeat.base_mode & m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED else None,
            sensors=sensors,
        )

    def _message(self, msgid: int) -> Message | None:
        frame = self._newest.get(msgid)
        return None if frame is None else self._decoder.decode(frame)


def _finite(value: float) -> float | None:
    return round(value, 2) if math.isfinite(value) else None


def _degrees(radians: float) -> float | None:
    return round(math.degrees(radians), 2) if math.isfinite(radians) else None


def _known(value: int, unknown: int) -> int | None:
    return None if value == unknown else value


def _scaled(value: int, parts: int) -> float | None:
    return None if value == _UNKNOWN_U16 else value / parts
