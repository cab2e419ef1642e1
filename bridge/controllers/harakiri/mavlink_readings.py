# SPDX-License-Identifier: GPL-3.0-or-later
"""The meaning of the MAVLink messages that Harakiri itself sends (baseflight_mavlink.c)."""

import math
from dataclasses import replace

from bridge.fc.mavlink_telemetry import MavlinkReadings
from bridge.fc.mission_flight import flight_report
from bridge.fc.msp_telemetry import velocity
from bridge.model import vehicle as v
from bridge.model.craft import FlightMode, active_boxes, flight_mode, names_of_active
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.msp.mission_flight import SUMMARY, decode_summary
from protocols.msp.telemetry import Sensor

_STICKS, _MAX_RSSI = 4, 255


class HarakiriReadings(MavlinkReadings):
    """The position is in GPS_RAW_INT, because there is no GLOBAL_POSITION_INT, and the height is in VFR_HUD.alt.

    That is above the launch point, where MAVLink has the height above mean sea level. rssi is 0..255.
    """

    is_represented = True

    def __init__(self, vehicle: v.Vehicle) -> None:
        super().__init__(vehicle)
        #: From the heartbeat, with the time, or None until one is heard, up to a second after arming.
        self._is_level: tuple[bool, float] | None = None
        self.readers |= {
            m.MAVLINK_MSG_ID_VFR_HUD: self._vfr_hud,
            m.MAVLINK_MSG_ID_NAMED_VALUE_INT: self._named_value_int,
            m.MAVLINK_MSG_ID_MISSION_ITEM_REACHED: self._mission_item_reached,
        }

    def heartbeat(self, message: Message, now: float) -> None:
        self._is_level = bool(message.base_mode & m.MAV_MODE_FLAG_STABILIZE_ENABLED), now
        self._hear_mode()
        self.hear_arming(message, now)

    def _hear_mode(self) -> None:
        """The heartbeat says only whether it levels itself. The rest follows from the pilot's switches."""
        switches, sticks = self.vehicle.last(v.Switches), self.vehicle.last(v.Sticks)
        is_resumed = switches is not None and sticks is None and self.vehicle.flight_mode is not None
        if self._is_level is None or is_resumed:  # just after a restart of the bridge in flight
            return
        is_level, heard_at = self._is_level
        mode = FlightMode.STABILIZE if is_level else FlightMode.ACRO
        if switches is not None and sticks is not None:
            heard_at = min(heard_at, sticks.heard_at)
            flags = active_boxes(switches.activation, sticks.channels_us[_STICKS:])
            by_switches = flight_mode(names_of_active(flags, switches.boxes))
            if by_switches not in (FlightMode.STABILIZE, FlightMode.HORIZON, FlightMode.ACRO):
                mode = by_switches
        self.vehicle.hear(v.Mode(heard_at, v.Source.MAVLINK, mode))

    def attitude(self, message: Message, now: float) -> None:
        health = self.vehicle.last(v.Health)
        has_compass = health is not None and Sensor.COMPASS in health.sensors
        self.vehicle.hear_uptime(now, message.time_boot_ms / 1000)
        self.hear_attitude(message, now, is_north_known=has_compass, has_rates=False)

    def gps_raw_int(self, message: Message, now: float) -> None:
        gps = self.hear_fix(message, now)
        if gps.fix is not v.Fix.NO_FIX:
            place = message.lat, message.lon, message.alt / 1000
            velocity_m_s = velocity(gps.ground_speed_m_s or 0.0, gps.course_deg)
            self.vehicle.hear(v.GlobalPosition(now, v.Source.MAVLINK, *place, *velocity_m_s))

    def _vfr_hud(self, message: Message, now: float) -> None:
        if math.isfinite(message.alt) and math.isfinite(message.climb):
            self.vehicle.hear(v.Height(now, v.Source.MAVLINK, message.alt, message.climb))

    def rc_channels(self, message: Message, now: float) -> None:
        self.hear_sticks(message, now)
        self._hear_mode()
        if message.rssi or self.vehicle.last(v.Signal) is not None:
            self.vehicle.hear(v.Signal(now, v.Source.MAVLINK, message.rssi / _MAX_RSSI))

    def _named_value_int(self, message: Message, now: float) -> None:
        """A Harakiri's report on the mission flight. The records reached have messages of their own."""
        progress = decode_summary(message.value) if message.name == SUMMARY else None
        if progress is None:
            return
        before = self.vehicle.last_flight
        reached = before.reached if before is not None and before.number else max((progress.record or 0) - 1, 0)
        report = replace(flight_report(replace(progress, reached=reached), before), way=None, summary=message.value)
        self.vehicle.hear(v.MissionLeg(now, v.Source.MAVLINK, report))

    def _mission_item_reached(self, message: Message, _now: float) -> None:
        leg, flight = self.vehicle.last(v.MissionLeg), self.vehicle.last_flight
        if leg is not None and flight is not None and flight.number:
            self.vehicle.hear(v.MissionLeg(leg.heard_at, leg.source, replace(flight, reached=message.seq)))
