# SPDX-License-Identifier: GPL-3.0-or-later
"""Readings of the vehicle from a flight controller's MAVLink: a Harakiri's, or another autopilot's.

A passed-through autopilot may send thousands of frames a second that nothing here needs: the newest of each kind is
kept as bytes until `settle`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import repeat

from bridge.fc.mission_flight import flight_report
from bridge.fc.msp_telemetry import velocity
from bridge.model import vehicle as v
from bridge.model.flight_mode import MISSION_BOXES, FlightMode, active_boxes, flight_mode, names_of_active
from protocols.mavlink.codec import decode
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.msp.mission_flight import SUMMARY, decode_summary
from protocols.msp.telemetry import Sensor

_HEARTBEAT = m.MAVLINK_MSG_ID_HEARTBEAT
#: Five lost heartbeats. Only then is a new system id followed, if its component id is the same, from its second
#: heartbeat on: after a stall the frames of two autopilots arrive in any order.
_GONE_S = 5.0
#: The autopilot field of a heartbeat's payload, and its value from cameras and gimbals. MAVLink 2 may omit it.
_AUTOPILOT_AT, _NO_AUTOPILOT = 5, bytes((m.MAV_AUTOPILOT_INVALID,))
_UNKNOWN_U16, _UNKNOWN_U8 = 0xFFFF, 0xFF
_MAX_RSSI, _HARAKIRI_MAX_RSSI = 254, 255
_STICKS, _CHANNELS = 4, 18
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


class MavlinkTelemetry:
    """Fills a vehicle from the frames of one autopilot: the first that is heard, until it falls silent.

    Harakiri (baseflight_mavlink.c) sends no GLOBAL_POSITION_INT: its position is in GPS_RAW_INT, and its height above
    the launch point in VFR_HUD.alt, where MAVLink has the one above mean sea level. Its rssi is 0..255.
    """

    def __init__(self, vehicle: v.Vehicle, *, is_harakiri: bool) -> None:
        self._vehicle = vehicle
        self._is_harakiri = is_harakiri
        #: From a Harakiri's heartbeat, with its time; None until one is heard, up to a second after arming.
        self._is_level: tuple[bool, float] | None = None
        #: The newest frame of each kind, and when it was heard. The keys are those of protocols.mavlink.frame.kinds.
        self._unread: dict[bytes, tuple[bytes, float]] = {}
        self._readers: dict[int, Callable[[Message, float], None]] = {
            _HEARTBEAT: self._heartbeat,
            m.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            m.MAVLINK_MSG_ID_BATTERY_STATUS: self._battery_status,
            m.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            m.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps_raw_int,
            m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position_int,
            m.MAVLINK_MSG_ID_VFR_HUD: self._vfr_hud,
            m.MAVLINK_MSG_ID_HOME_POSITION: lambda message, _: vehicle.hear_home(message.latitude, message.longitude),
            m.MAVLINK_MSG_ID_SCALED_PRESSURE: self._scaled_pressure,
            m.MAVLINK_MSG_ID_RC_CHANNELS: self._rc_channels,
            m.MAVLINK_MSG_ID_RC_CHANNELS_RAW: self._rc_channels,
            m.MAVLINK_MSG_ID_SYSTEM_TIME: lambda message, now: vehicle.hear_gps_time(
                now, v.Source.MAVLINK, message.time_unix_usec / 1e6
            ),
        }
        if is_harakiri:
            self._readers |= {
                m.MAVLINK_MSG_ID_NAMED_VALUE_INT: self._named_value_int,
                m.MAVLINK_MSG_ID_MISSION_ITEM_REACHED: self._mission_item_reached,
            }
        #: The message ids of the kinds that the autopilot sends and that are read; its heartbeats.
        self._known: dict[bytes, int] = {}
        self._beats: set[bytes] = set()
        self._compid: int | None = None
        #: The sender of a heartbeat since then.
        self._successor: tuple[int, int] | None = None
        #: When the autopilot counts as gone if no heartbeat of it is heard; a Harakiri never does.
        self._gone_at = -math.inf

    def take(self, frames: Sequence[bytes], kinds: Sequence[bytes], now: float) -> None:
        """Keep the newest frames. Heartbeats are read at once: arming must be noticed."""
        if now >= self._gone_at:
            self._recognise(frames, now)
        self._unread.update(zip(kinds, zip(frames, repeat(now)), strict=False))
        if not self._beats.isdisjoint(kinds):
            self._successor = None
            self._gone_at = max(self._gone_at, now + _GONE_S)
            for beat in self._beats.intersection(kinds):
                self._read(beat, *self._unread.pop(beat))
        if self._is_harakiri or len(self._unread) > _MAX_KINDS:
            self.settle()

    def settle(self) -> None:
        """Read what `take` has kept."""
        unread, self._unread = self._unread, {}
        for kind, (frame, heard_at) in unread.items():
            if kind in self._known:
                self._read(kind, frame, heard_at)

    def _recognise(self, frames: Sequence[bytes], now: float) -> None:
        for frame in map(MavlinkFrame, frames):
            is_heartbeat = frame.msgid == _HEARTBEAT and self._compid in (None, frame.compid)
            if self._is_harakiri or (is_heartbeat and frame.payload[_AUTOPILOT_AT:][:1] != _NO_AUTOPILOT):
                sender = bytes(frame.sender)
                keys = {sender + msgid.to_bytes(size, "little"): msgid for msgid in self._readers for size in (1, 3)}
                if self._known and keys != self._known:
                    former, self._successor = self._successor, frame.sender
                    if former != frame.sender:
                        continue
                    # The values of two autopilots must not mix.
                    self._vehicle.forget()
                self._unread.clear()
                self._known, self._compid = keys, frame.compid
                self._beats = {kind for kind, msgid in keys.items() if msgid == _HEARTBEAT}
                self._gone_at = math.inf if self._is_harakiri else now + _GONE_S
                return

    def _read(self, kind: bytes, frame: bytes, now: float) -> None:
        whole = MavlinkFrame(frame)
        message = decode(whole)
        if message is not None:
            self._readers[self._known[kind]](message, now)

    def _heartbeat(self, message: Message, now: float) -> None:
        armed = bool(message.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED)
        if self._is_harakiri:
            self._is_level = bool(message.base_mode & m.MAV_MODE_FLAG_STABILIZE_ENABLED), now
            self._hear_harakiri_mode()
        elif message.base_mode & m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            self._vehicle.hear(v.Mode(now, v.Source.MAVLINK, str(message.custom_mode)))
        self._vehicle.hear(v.FlightState(now, v.Source.MAVLINK, armed))

    def _hear_harakiri_mode(self) -> None:
        """Its heartbeat says only whether it levels itself; the rest follows from the pilot's switches."""
        switches, sticks = self._vehicle.last(v.Switches), self._vehicle.last(v.Sticks)
        is_resumed = switches is not None and sticks is None and self._vehicle.flight_mode is not None
        if self._is_level is None or is_resumed:  # just after a restart of the bridge in flight
            return
        is_level, heard_at = self._is_level
        mode = FlightMode.STABILIZE if is_level else FlightMode.ACRO
        if switches is not None and sticks is not None:
            heard_at = min(heard_at, sticks.heard_at)
            flags = active_boxes(switches.activation, sticks.channels_us[_STICKS:])
            # The switch alone flies no mission.
            by_switches = flight_mode(names_of_active(flags, switches.boxes) - MISSION_BOXES)
            if by_switches not in (FlightMode.STABILIZE, FlightMode.HORIZON, FlightMode.ACRO):
                mode = by_switches
        self._vehicle.hear(v.Mode(heard_at, v.Source.MAVLINK, mode))

    def _named_value_int(self, message: Message, now: float) -> None:
        """A Harakiri's report on its mission flight; the records reached have messages of their own."""
        progress = decode_summary(message.value) if message.name == SUMMARY else None
        if progress is None:
            return
        before = self._vehicle.last_flight
        reached = before.reached if before is not None and before.number else max((progress.record or 0) - 1, 0)
        report = replace(flight_report(replace(progress, reached=reached), before), way=None)
        self._vehicle.hear(v.MissionLeg(now, v.Source.MAVLINK, report))

    def _mission_item_reached(self, message: Message, _now: float) -> None:
        leg, flight = self._vehicle.last(v.MissionLeg), self._vehicle.last_flight
        if leg is not None and flight is not None and flight.number:
            self._vehicle.hear(v.MissionLeg(leg.heard_at, leg.source, replace(flight, reached=message.seq)))

    def _attitude(self, message: Message, now: float) -> None:
        roll, pitch, yaw = map(math.degrees, (message.roll, message.pitch, message.yaw))
        if not (math.isfinite(roll) and math.isfinite(pitch) and math.isfinite(yaw)):
            return
        if self._is_harakiri:
            self._vehicle.hear_uptime(now, message.time_boot_ms / 1000)
        health = self._vehicle.last(v.Health)
        is_north_known = not self._is_harakiri or (health is not None and Sensor.COMPASS in health.sensors)
        rates = None
        if not self._is_harakiri and math.isfinite(message.rollspeed + message.pitchspeed + message.yawspeed):
            rates = math.degrees(message.rollspeed), math.degrees(message.pitchspeed), math.degrees(message.yawspeed)
        self._vehicle.hear(v.Orientation(now, v.Source.MAVLINK, roll, pitch, yaw % 360, is_north_known, rates))

    def _gps_raw_int(self, message: Message, now: float) -> None:
        if message.fix_type == m.GPS_FIX_TYPE_NO_GPS and not self._is_harakiri:
            return
        fix = v.Fix(min(max(message.fix_type, v.Fix.NO_FIX), v.Fix.THREE_D))
        satellites = _known(message.satellites_visible, _UNKNOWN_U8)
        if fix is v.Fix.NO_FIX:
            self._vehicle.hear(v.GpsFix(now, v.Source.MAVLINK, fix, satellites))
            return
        speed, course = _scaled(message.vel, 100), _scaled(message.cog, 100)
        self._vehicle.hear(v.GpsFix(now, v.Source.MAVLINK, fix, satellites, speed, course, _scaled(message.eph, 100)))
        if self._is_harakiri:
            north, east = velocity(speed or 0.0, course)
            self._vehicle.hear(
                v.GlobalPosition(now, v.Source.MAVLINK, message.lat, message.lon, message.alt / 1000, north, east)
            )

    def _global_position_int(self, message: Message, now: float) -> None:
        north, east, up = message.vx / 100, message.vy / 100, -message.vz / 100
        self._vehicle.hear(v.Height(now, v.Source.MAVLINK, message.relative_alt / 1000, up))
        gps = self._vehicle.fresh(v.GpsFix, now)
        if (message.lat or message.lon) and (gps is None or gps.fix is not v.Fix.NO_FIX):
            # Without a fix ArduPilot repeats the last place.
            self._vehicle.hear(
                v.GlobalPosition(now, v.Source.MAVLINK, message.lat, message.lon, message.alt / 1000, north, east)
            )

    def _vfr_hud(self, message: Message, now: float) -> None:
        if self._is_harakiri and math.isfinite(message.alt) and math.isfinite(message.climb):
            self._vehicle.hear(v.Height(now, v.Source.MAVLINK, message.alt, message.climb))

    def _sys_status(self, message: Message, now: float) -> None:
        well = message.onboard_control_sensors_present & message.onboard_control_sensors_health
        sensors = Sensor(sum(sensor for bit, sensor in SENSORS.items() if bit & well))
        self._vehicle.hear(v.Health(now, v.Source.MAVLINK, sensors))
        current = None if message.current_battery < 0 else message.current_battery / 100
        voltage = _scaled(message.voltage_battery, 1000) or None
        remaining = None if message.battery_remaining < 0 else min(message.battery_remaining, 100)
        self._vehicle.hear(v.Power(now, v.Source.MAVLINK, voltage, current, remaining_percent=remaining))

    def _battery_status(self, message: Message, now: float) -> None:
        # SYS_STATUS has the voltage of the first battery.
        if message.id == 0 and message.current_consumed >= 0:
            self._vehicle.hear(v.Charge(now, v.Source.MAVLINK, message.current_consumed))

    def _scaled_pressure(self, message: Message, now: float) -> None:
        self._vehicle.hear(v.Pressure(now, v.Source.MAVLINK, message.press_abs, message.temperature / 100))

    def _rc_channels(self, message: Message, now: float) -> None:
        if getattr(message, "port", 0):
            # RC_CHANNELS_RAW with the channels above 8.
            return
        values = [getattr(message, f"chan{number}_raw", _UNKNOWN_U16) for number in range(1, _CHANNELS + 1)]
        channels = [0 if value == _UNKNOWN_U16 else value for value in values]
        while channels and not channels[-1]:
            channels.pop()
        if channels:
            self._vehicle.hear(v.Sticks(now, v.Source.MAVLINK, tuple(channels)))
        if self._is_harakiri:
            self._hear_harakiri_mode()
            if message.rssi or self._vehicle.last(v.Signal) is not None:
                self._vehicle.hear(v.Signal(now, v.Source.MAVLINK, message.rssi / _HARAKIRI_MAX_RSSI))
        elif message.rssi != _UNKNOWN_U8:
            self._vehicle.hear(v.Signal(now, v.Source.MAVLINK, message.rssi / _MAX_RSSI))


def _known(value: int, unknown: int) -> int | None:
    return None if value == unknown else value


def _scaled(value: int, parts: int) -> float | None:
    return None if value == _UNKNOWN_U16 else value / parts
