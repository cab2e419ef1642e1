# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings of the vehicle from a flight controller's MAVLink.

A passed-through autopilot may send thousands of frames a second that are not needed here: the newest of each kind is
kept as bytes until `settle`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import repeat

from bridge.model import vehicle as v
from protocols.mavlink.codec import decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.msp.telemetry import Sensor

_HEARTBEAT = m.MAVLINK_MSG_ID_HEARTBEAT
#: The autopilot field of a heartbeat's payload, and the value from cameras and gimbals. MAVLink 2 may omit it.
_AUTOPILOT_AT, _NO_AUTOPILOT = 5, bytes((m.MAV_AUTOPILOT_INVALID,))
_UNKNOWN_U16, _UNKNOWN_U8 = 0xFFFF, 0xFF
_MAX_RSSI, _CHANNELS = 254, 18
#: Messages kept: all of one dialect from a few components.
_MAX_KINDS = 1024
#: MAV_SYS_STATUS_SENSOR bits.
SENSORS = {
    m.MAV_SYS_STATUS_SENSOR_3D_ACCEL: Sensor.ACCELEROMETER,
    m.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: Sensor.BAROMETER,
    m.MAV_SYS_STATUS_SENSOR_3D_MAG: Sensor.COMPASS,
    m.MAV_SYS_STATUS_SENSOR_GPS: Sensor.GPS,
    m.MAV_SYS_STATUS_SENSOR_LASER_POSITION: Sensor.SONAR,
}


class MavlinkReadings:
    """The meaning of an autopilot's messages: the readings of the vehicle in each. A profile may have its own.

    `readers`: by message id, with the time the message was heard. `is_represented`: the bridge represents this board to
    ground stations, so any frame shows that it is there, and none may wait for `settle`.
    """

    is_represented = False

    def __init__(self, vehicle: v.Vehicle) -> None:
        self.vehicle = vehicle
        self.readers: dict[int, Callable[[Message, float], None]] = {
            _HEARTBEAT: self.heartbeat,
            m.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            m.MAVLINK_MSG_ID_BATTERY_STATUS: self._battery_status,
            m.MAVLINK_MSG_ID_ATTITUDE: self.attitude,
            m.MAVLINK_MSG_ID_GPS_RAW_INT: self.gps_raw_int,
            m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position_int,
            m.MAVLINK_MSG_ID_HOME_POSITION: lambda message, _: vehicle.hear_home(message.latitude, message.longitude),
            m.MAVLINK_MSG_ID_RC_CHANNELS: self.rc_channels,
            m.MAVLINK_MSG_ID_RC_CHANNELS_RAW: self.rc_channels,
            m.MAVLINK_MSG_ID_SYSTEM_TIME: lambda message, now: vehicle.hear_gps_time(
                now, v.Source.MAVLINK, message.time_unix_usec / 1e6
            ),
        }

    def heartbeat(self, message: Message, now: float) -> None:
        if message.base_mode & m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            self.vehicle.hear(v.Mode(now, v.Source.MAVLINK, str(message.custom_mode)))
        self.hear_arming(message, now)

    def hear_arming(self, message: Message, now: float) -> None:
        armed = bool(message.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED)
        self.vehicle.hear(v.FlightState(now, v.Source.MAVLINK, armed))

    def attitude(self, message: Message, now: float) -> None:
        self.hear_attitude(message, now, is_north_known=True)

    def hear_attitude(self, message: Message, now: float, *, is_north_known: bool) -> None:
        roll, pitch, yaw = map(math.degrees, (message.roll, message.pitch, message.yaw))
        if all(abs(angle) <= 360 for angle in (roll, pitch, yaw)):  # NaN is not
            self.vehicle.hear(v.Orientation(now, v.Source.MAVLINK, roll, pitch, yaw % 360, is_north_known))

    def gps_raw_int(self, message: Message, now: float) -> None:
        if message.fix_type != m.GPS_FIX_TYPE_NO_GPS:
            self.hear_fix(message, now)

    def hear_fix(self, message: Message, now: float) -> v.GpsFix:
        fix = v.Fix(min(max(message.fix_type, v.Fix.NO_FIX), v.Fix.THREE_D))
        gps = v.GpsFix(now, v.Source.MAVLINK, fix, _known(message.satellites_visible, _UNKNOWN_U8))
        if fix is not v.Fix.NO_FIX:
            speed, course, hdop = (_scaled(value, 100) for value in (message.vel, message.cog, message.eph))
            gps = replace(gps, ground_speed_m_s=speed, course_deg=course, hdop=hdop)
        self.vehicle.hear(gps)
        return gps

    def _global_position_int(self, message: Message, now: float) -> None:
        north, east, up = message.vx / 100, message.vy / 100, -message.vz / 100
        self.vehicle.hear(v.Height(now, v.Source.MAVLINK, message.relative_alt / 1000, up))
        gps = self.vehicle.fresh(v.GpsFix, now)
        if (message.lat or message.lon) and (gps is None or gps.fix is not v.Fix.NO_FIX):
            # Without a fix ArduPilot repeats the last place.
            self.vehicle.hear(
                v.GlobalPosition(now, v.Source.MAVLINK, message.lat, message.lon, message.alt / 1000, north, east)
            )

    def _sys_status(self, message: Message, now: float) -> None:
        well = message.onboard_control_sensors_present & message.onboard_control_sensors_health
        sensors = Sensor(sum(sensor for bit, sensor in SENSORS.items() if bit & well))
        self.vehicle.hear(v.Health(now, v.Source.MAVLINK, sensors))
        current = None if message.current_battery < 0 else message.current_battery / 100
        voltage = _scaled(message.voltage_battery, 1000) or None
        remaining = None if message.battery_remaining < 0 else min(message.battery_remaining, 100)
        self.vehicle.hear(v.Power(now, v.Source.MAVLINK, voltage, current, remaining_percent=remaining))

    def _battery_status(self, message: Message, now: float) -> None:
        # SYS_STATUS has the voltage of the first battery.
        if message.id == 0 and message.current_consumed >= 0:
            self.vehicle.hear(v.Charge(now, v.Source.MAVLINK, message.current_consumed))

    def rc_channels(self, message: Message, now: float) -> None:
        if getattr(message, "port", 0):
            # RC_CHANNELS_RAW with the channels above 8.
            return
        self.hear_sticks(message, now)
        if message.rssi != _UNKNOWN_U8:
            self.vehicle.hear(v.Signal(now, v.Source.MAVLINK, message.rssi / _MAX_RSSI))

    def hear_sticks(self, message: Message, now: float) -> None:
        values = [getattr(message, f"chan{number}_raw", _UNKNOWN_U16) for number in range(1, _CHANNELS + 1)]
        channels = [0 if value == _UNKNOWN_U16 else value for value in values]
        while channels and not channels[-1]:
            channels.pop()
        if channels:
            self.vehicle.hear(v.Sticks(now, v.Source.MAVLINK, tuple(channels)))


class MavlinkTelemetry:
    """Fills a vehicle from the frames of one autopilot: the first that is heard."""

    def __init__(self, readings: MavlinkReadings) -> None:
        self._readings = readings
        #: The newest frame of each kind, and when it was heard. The keys are those of protocols.mavlink.frame.kinds.
        self._unread: dict[bytes, tuple[bytes, float]] = {}
        #: The message ids of the kinds that the autopilot sends and that are read; the heartbeats.
        self._known: dict[bytes, int] = {}
        self._beats: set[bytes] = set()

    def take(self, frames: Sequence[bytes], kinds: Sequence[bytes], now: float) -> None:
        """Keep the newest frames. Heartbeats are read at once: arming must be noticed."""
        if not self._known:
            self._recognise(frames)
        self._unread.update(zip(kinds, zip(frames, repeat(now)), strict=False))
        if not self._beats.isdisjoint(kinds):
            for beat in self._beats.intersection(kinds):
                self._read(beat, *self._unread.pop(beat))
        if self._readings.is_represented or len(self._unread) > _MAX_KINDS:
            self.settle()

    def settle(self) -> None:
        """Read what `take` has kept."""
        unread, self._unread = self._unread, {}
        for kind, (frame, heard_at) in unread.items():
            if kind in self._known:
                self._read(kind, frame, heard_at)

    def _recognise(self, frames: Sequence[bytes]) -> None:
        for frame in map(MavlinkFrame, frames):
            is_autopilot = frame.msgid == _HEARTBEAT and frame.payload[_AUTOPILOT_AT:][:1] != _NO_AUTOPILOT
            if self._readings.is_represented or is_autopilot:
                sender, msgids = bytes(frame.sender), self._readings.readers
                self._known = {sender + msgid.to_bytes(size, "little"): msgid for msgid in msgids for size in (1, 3)}
                self._beats = {kind for kind, msgid in self._known.items() if msgid == _HEARTBEAT}
                return

    def _read(self, kind: bytes, frame: bytes, now: float) -> None:
        message = decode(MavlinkFrame(frame))
        if message is not None:
            self._readings.readers[self._known[kind]](message, now)


def _known(value: int, unknown: int) -> int | None:
    return None if value == unknown else value


def _scaled(value: int, parts: int) -> float | None:
    return None if value == _UNKNOWN_U16 else value / parts
