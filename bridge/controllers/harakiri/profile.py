# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri: the recognition, and the profile for each protocol.

Disarmed it speaks MSP. Armed, the setting tele_prot decides: MSP (0), FrSky telemetry (1) or MAVLink (2, 3).
"""

from dataclasses import replace

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.controllers.harakiri.mavlink_readings import HarakiriReadings
from bridge.controllers.harakiri.mission_store import HarakiriArmedMissions, HarakiriMissions
from bridge.controllers.harakiri.settings import HarakiriFcSettings
from bridge.controllers.msp_parts import MspPartSettings
from bridge.fc.mission_flight import FLIGHT_DECODERS, FLIGHT_POLL
from bridge.fc.profile import FlightController, Interview, Profile, Spoken
from bridge.line.conversation import Conversation
from bridge.line.poll_schedule import BOX_POLL, POLLS
from bridge.model.craft import FlightMode, airframe
from bridge.model.missions import Refusal
from bridge.model.vehicle import Health, Mode, Sticks, Vehicle
from bridge.voice import sentences
from protocols.mission_item import MissionResult
from protocols.msp.mission import INFO_SIZE, MissionCommand, decode_info
from protocols.msp.telemetry import Sensor
from protocols.rights.msp import Firmware

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
