# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV: the recognition, the profile, and the readings that only INAV has."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf

from bridge.controllers.inav.geozones import InavGeozones, has_zones
from bridge.controllers.inav.limits import saved_limits
from bridge.controllers.inav.mission_store import InavMissions
from bridge.controllers.inav.places import InavSafehomes
from bridge.controllers.inav.settings import InavFcSettings
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.fc.msp_telemetry import hear_box_flags
from bridge.fc.profile import POLL_FOR, SILENCE_WITH_H7_S, Decoder, FlightController, Interview, Profile
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import NAV_POLL, POLLS, Poll
from bridge.missions.place_lists import NO_PLACES
from bridge.model.craft import FAILSAFE_BOX, Airframe
from bridge.model.vehicle import Airspeed, Charge, Health, Load, Power, Readiness, Reading, Signal, Source, Vehicle
from protocols.msp.commands import Msp
from protocols.msp.frame import request
from protocols.msp.inav import (
    AIRSPEED_SIZE,
    ANALOG_SIZE,
    MIXER,
    MIXER_SIZE,
    RTC_SIZE,
    STATUS_SIZE,
    decode_airspeed,
    decode_inav_analog,
    decode_inav_status,
    decode_platform,
    decode_rtc,
)
from protocols.msp.nav import INFO_SIZE, Nav, decode_info, decode_wp
from protocols.msp.telemetry import decode_analog
from protocols.rights.msp import Firmware

INAV_POLLS = (
    Poll(Msp.INAV_STATUS, request(Msp.INAV_STATUS), STATUS_SIZE, 1.0),
    Poll(Msp.INAV_ANALOG, request(Msp.INAV_ANALOG), ANALOG_SIZE, 1.0),
    Poll(Msp.INAV_AIR_SPEED, request(Msp.INAV_AIR_SPEED), AIRSPEED_SIZE, 0.5),
    Poll(Msp.RTC, request(Msp.RTC), RTC_SIZE, 2.0),
    # For other programs only.
    Poll(Msp.SENSOR_STATUS, request(Msp.SENSOR_STATUS), 9, inf),
    Poll(Msp.BOX, request(Msp.BOX), 8, inf),  # the active boxes
    Poll(Msp.STATUS_EX, request(Msp.STATUS_EX), 16, inf),
    Poll(Msp.GPSSTATISTICS, request(Msp.GPSSTATISTICS), 20, inf),
    Poll(Msp.SONAR, request(Msp.SONAR), 4, inf),
    Poll(Msp.INAV_DEBUG, request(Msp.INAV_DEBUG), 32, inf),
    Poll(Msp.INAV_TEMPERATURES, request(Msp.INAV_TEMPERATURES), 16, inf),
)
_POLL_FOR: Mapping[type[Reading], Msp] = {
    Power: Msp.INAV_ANALOG,
    Charge: Msp.INAV_ANALOG,
    Signal: Msp.INAV_ANALOG,
    Airspeed: Msp.INAV_AIR_SPEED,
    Load: Msp.INAV_STATUS,
    Readiness: Msp.INAV_STATUS,
}
_MAX_RSSI = 1023
#: In INAV_STATUS.
_BOX_FLAGS = 64


def _inav_status(vehicle: Vehicle, payload: bytes, controller: FlightController, now: float) -> None:
    reply = decode_inav_status(payload)
    if reply is not None:
        vehicle.hear(Health(now, Source.MSP, reply.sensors, reply.cycle_time_us, reply.i2c_errors))
        vehicle.hear(Load(now, Source.MSP, reply.load_percent / 100))
        vehicle.hear(Readiness(now, Source.MSP, reply.blockers))
        hear_box_flags(vehicle, reply.box_flags, controller, now, known=_BOX_FLAGS)


def arming_blockers(vehicle: Vehicle, now: float) -> tuple[str, ...] | None:
    """The reasons that prevent arming, as last reported, or None before the first report."""
    readiness = vehicle.fresh(Readiness, now)
    return None if readiness is None else readiness.blockers


def _inav_analog(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """INAV_ANALOG. Without a battery the cell count is 0 and the percentage meaningless."""
    reply = decode_inav_analog(payload)
    if reply is None:
        return
    if reply.cells and reply.battery_cv:
        volts, amperes = reply.battery_cv / 100, reply.current_ca / 100
        vehicle.hear(Power(now, Source.MSP, volts, amperes, reply.cells, reply.percent))
        vehicle.hear(Charge(now, Source.MSP, reply.drawn_mah))
    else:
        vehicle.hear(Power(now, Source.MSP, reply.battery_cv / 100 or None))
    _hear_signal(vehicle, reply.rssi, now)


def _analog(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """MSP_ANALOG, for the signal strength; INAV_ANALOG has the battery in a finer scale."""
    reply = decode_analog(payload)
    if reply is not None:
        _hear_signal(vehicle, reply.rssi, now)


def _hear_signal(vehicle: Vehicle, rssi: int, now: float) -> None:
    if rssi or vehicle.last(Signal) is not None:
        vehicle.hear(Signal(now, Source.MSP, min(rssi / _MAX_RSSI, 1.0)))


def _airspeed(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    """INAV_AIR_SPEED. Without a pitot tube it is always 0."""
    speed_cms = decode_airspeed(payload)
    if speed_cms is not None and (speed_cms or vehicle.last(Airspeed) is not None):
        vehicle.hear(Airspeed(now, Source.MSP, speed_cms / 100))


def _time(vehicle: Vehicle, payload: bytes, _controller: FlightController, now: float) -> None:
    unix_s = decode_rtc(payload)
    if unix_s is not None:
        vehicle.hear_gps_time(now, Source.MSP, unix_s)


def _home(vehicle: Vehicle, payload: bytes, _controller: FlightController, _now: float) -> None:
    """MSP_WP 0. The altitude is in cm, in RAW_GPS in whole metres."""
    answer = decode_wp(payload)
    if answer is not None and answer[0] == 0:
        home = answer[1]
        vehicle.hear_home(home.lat_e7, home.lon_e7, home.alt_cm / 100)


def _nothing(_vehicle: Vehicle, _payload: bytes, _controller: FlightController, _now: float) -> None:
    """INAV's BOX has the active boxes, as INAV_STATUS does. The switches' ranges are elsewhere."""


INAV_DECODERS: Mapping[int, Decoder] = {
    Msp.INAV_STATUS: _inav_status,
    Msp.INAV_ANALOG: _inav_analog,
    Msp.INAV_AIR_SPEED: _airspeed,
    Msp.ANALOG: _analog,
    Msp.WP: _home,
    Msp.RTC: _time,
    Msp.BOX: _nothing,
}


_VARIANT = "INAV"
#: The constant bytes of GETINFO.
_STABLE_INFO = 2
#: By INAV's platform type, from 0.
_AIRFRAMES = (
    Airframe.QUADROTOR,
    Airframe.FIXED_WING,
    Airframe.HELICOPTER,
    Airframe.TRICOPTER,
    Airframe.ROVER,
    Airframe.BOAT,
)
#: Permanent box ids (docs/inav.md) of the modes that make a flight mode.
_BOXES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "NAV ALTHOLD", 10: "NAV RTH", 11: "NAV POSHOLD", 12: "MANUAL",
    27: FAILSAFE_BOX, 28: "NAV WP", 36: "NAV LAUNCH", 45: "NAV COURSE HOLD", 53: "NAV CRUISE", 64: "ANGLE HOLD",
}  # fmt: skip


def _recognise(board: Interview) -> Conversation[FlightController | None]:
    if (yield from board.ident()) is not None or (yield from board.variant()) != _VARIANT:
        return None
    boxes = yield from board.boxes_by_id(_BOXES)
    controller = FlightController(PROFILE, PROFILE.name, boxes=boxes, firmware=Firmware.INAV)
    # The pilot may load another mission at any time: only the capacity is constant.
    info = decode_info((yield from board.ask(Nav.GETINFO, INFO_SIZE, stable=_STABLE_INFO)).payload)
    if info is None or not info.capacity or controller.arm_bit is None:
        # An arm flag is needed to prevent a mission write in flight.
        return None
    platform = decode_platform((yield from board.ask(MIXER, MIXER_SIZE)).payload)
    airframe = _AIRFRAMES[platform] if platform is not None and platform < len(_AIRFRAMES) else None
    version = yield from board.version()
    return replace(controller, airframe=airframe, capacity=info.capacity, version=version)


PROFILE = Profile(
    "INAV",
    "INAV",
    recognise=_recognise,
    polls=(*POLLS, NAV_POLL, *INAV_POLLS),
    poll_for={**POLL_FOR, **_POLL_FOR},
    decoders=INAV_DECODERS,
    arming_blockers=arming_blockers,
    has_2d_fix=True,
    accepts_any_byte=True,
    calibrates_six_positions=True,
    # The serial task runs 100 times a second (fc_tasks.c).
    turn_s=0.01,
    silence_s=SILENCE_WITH_H7_S,
    missions=lambda board, vehicle, _: InavMissions(NavProfile(board.capacity), board, vehicle),
    fences=lambda board, _vehicle: InavGeozones(board) if has_zones(board) else NO_PLACES,
    rally=lambda board, _vehicle: InavSafehomes(board),
    settings=InavFcSettings,
    check_kind="inav",
    rules=lambda settings: NavRules(NavProfile(limits=saved_limits(settings.saved))),
)
