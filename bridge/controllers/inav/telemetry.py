# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own readings: load, arming blockers, battery percentage and cells, airspeed (MSP v2), time."""

from collections.abc import Mapping
from math import inf

from bridge.fc.msp_telemetry import hear_box_flags
from bridge.fc.profile import Decoder, FlightController
from bridge.line.poll_schedule import Poll
from bridge.model.vehicle import Airspeed, Charge, Health, Load, Power, Readiness, Signal, Source, Vehicle
from protocols.msp.commands import Msp
from protocols.msp.frame import request
from protocols.msp.inav import (
    AIRSPEED_SIZE,
    ANALOG_SIZE,
    RTC_SIZE,
    STATUS_SIZE,
    decode_airspeed,
    decode_inav_analog,
    decode_inav_status,
    decode_rtc,
)
from protocols.msp.nav import decode_wp
from protocols.msp.telemetry import decode_analog

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
    """MSP_WP 0. Its altitude is in cm; RAW_GPS has whole metres."""
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
