# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri: the recognition, and the profile for each protocol.

Disarmed it speaks MSP. Armed, the setting tele_prot decides: MSP (0), FrSky telemetry (1) or MAVLink (2, 3).
"""

from dataclasses import replace

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.controllers.harakiri.mission_store import HarakiriArmedMissions, HarakiriMissions
from bridge.controllers.harakiri.settings import HarakiriFcSettings
from bridge.controllers.msp_parts import MspPartSettings
from bridge.fc.mavlink_telemetry import MavlinkReadings
from bridge.fc.mission_flight import FLIGHT_DECODERS, FLIGHT_POLL, flight_report
from bridge.fc.msp_telemetry import velocity
from bridge.fc.profile import POLL_FOR, FlightController, Interview, Profile, Spoken
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import BOX_POLL, POLLS
from bridge.model import vehicle as v
from bridge.model.craft import FlightMode, active_boxes, airframe, flight_mode, names_of_active
from bridge.model.missions import Refusal
from bridge.model.vehicle import Health, Mode, Sticks, Vehicle
from bridge.voice import sentences
from protocols.mavlink.dialect import Message
from protocols.mavlink.dialect import messages as m
from protocols.mission_item import MissionResult
from protocols.msp.commands import Msp
from protocols.msp.mission import INFO_SIZE, MissionCommand, decode_info
from protocols.msp.mission_flight import SUMMARY, decode_summary
from protocols.msp.telemetry import Sensor
from protocols.rights.msp import Firmware

_STICKS, _MAX_RSSI, _MOST_M = 4, 255, 1e6


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
        self.hear_attitude(message, now, is_north_known=has_compass)

    def gps_raw_int(self, message: Message, now: float) -> None:
        gps = self.hear_fix(message, now)
        if gps.fix is not v.Fix.NO_FIX:
            place = message.lat, message.lon, message.alt / 1000
            velocity_m_s = velocity(gps.ground_speed_m_s or 0.0, gps.course_deg)
            self.vehicle.hear(v.GlobalPosition(now, v.Source.MAVLINK, *place, *velocity_m_s))

    def _vfr_hud(self, message: Message, now: float) -> None:
        if abs(message.alt) < _MOST_M and abs(message.climb) < _MOST_M:  # NaN is not
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
        before = self.vehicle.last_report
        reached = before.reached if before is not None and before.number else max((progress.record or 0) - 1, 0)
        report = replace(flight_report(replace(progress, reached=reached), before), way=None, summary=message.value)
        self.vehicle.hear(v.MissionLeg(now, v.Source.MAVLINK, report))

    def _mission_item_reached(self, message: Message, _now: float) -> None:
        leg, flight = self.vehicle.last(v.MissionLeg), self.vehicle.last_report
        if leg is not None and flight is not None and flight.number:
            self.vehicle.hear(v.MissionLeg(leg.heard_at, leg.source, replace(flight, reached=message.seq)))


_FAMILY = "Harakiri"
_VERSION = 211
_CAPABILITY = 0x80000000
#: A box that only Harakiri has.
_OWN_BOX = "GTUNE"


_THROTTLE = 2
#: The highest value of rc_minchk, below which the throttle must be. The default is 1100.
_SURELY_NOT_LOW_US = 1250


def _recognise_patched(board: Interview) -> Conversation[FlightController | None]:
    harakiri = yield from _recognise_unpatched(board)
    if harakiri is None:
        return None
    # Sent last, and only to a Harakiri: on other boards this command number means something else.
    info = decode_info((yield from board.ask(MissionCommand.INFO, INFO_SIZE)).payload)
    if info is None:
        return None
    return replace(harakiri, profile=PATCHED, name=PATCHED.name, info=info, firmware=Firmware.HARAKIRI_MISSIONS)


def _recognise_unpatched(board: Interview) -> Conversation[FlightController | None]:
    ident = yield from board.ident()
    if ident is None or (ident.version, ident.capability) != (_VERSION, _CAPABILITY):
        return None
    boxes = yield from board.box_names()
    if _OWN_BOX not in boxes:
        return None
    return FlightController(
        UNPATCHED, UNPATCHED.name, airframe(ident.mixer), boxes, version=ident.release, firmware=Firmware.HARAKIRI
    )


def arming_blockers(vehicle: Vehicle, now: float) -> tuple[str, ...]:
    """The reasons that surely prevent arming: it reports none (mw.c, ArmIFpossible).

    An accelerometer that is not calibrated, a scheduled write and the failsafe's delay prevent it, too, unseen.
    """
    sticks, mode, health = vehicle.fresh(Sticks, now), vehicle.fresh(Mode, now), vehicle.last(Health)
    throttle_us = () if sticks is None else sticks.channels_us[_THROTTLE : _THROTTLE + 1]
    has_baro = health is not None and Sensor.BAROMETER in health.sensors
    conditions = {
        "throttle not low": throttle_us and throttle_us[0] >= _SURELY_NOT_LOW_US,
        "switch BARO off": has_baro and mode is not None and mode.mode is FlightMode.ALT_HOLD,
    }
    return tuple(blocker for blocker, holds in conditions.items() if holds)


PATCHED = Profile(
    "Harakiri with the mission extension",
    _FAMILY,
    recognise=_recognise_patched,
    missions=HarakiriMissions,
    settings=HarakiriFcSettings,
    polls=(*POLLS, BOX_POLL, FLIGHT_POLL),
    poll_for={**POLL_FOR, v.MissionLeg: Msp.FLIGHT},
    decoders=FLIGHT_DECODERS,
    check_kind="harakiri",
    rules=lambda settings: HarakiriRules(takeoff_max_m=settings.takeoff_max_m),
    restarts_after_calibration=True,
    arming_blockers=arming_blockers,
)
UNPATCHED = Profile(
    "Harakiri without the mission extension",
    _FAMILY,
    recognise=_recognise_unpatched,
    polls=(*POLLS, BOX_POLL),
    missions=Refusal(MissionResult.UNSUPPORTED, sentences.NOT_PATCHED()),
    settings=MspPartSettings,
    restarts_after_calibration=True,
    arming_blockers=arming_blockers,
)
MAVLINK = Profile(
    "Harakiri in MAVLink mode",
    _FAMILY,
    Spoken.MAVLINK,
    missions=HarakiriArmedMissions,
    arming_blockers=arming_blockers,
    mavlink_readings=HarakiriReadings,
    mavlink_sender=(1, 1, 200),  # baseflight_mavlink.c. Other autopilots send as component 1
)
PROFILES = (PATCHED, UNPATCHED, MAVLINK)
