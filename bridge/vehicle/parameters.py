# SPDX-License-Identifier: GPL-3.0-or-later
"""The short list of parameters that ground stations need to see (https://mavlink.io/en/services/parameter.html).

QGroundControl reads those of receiver, compass and accelerometer once when it connects (APMRadioComponent.cc,
APMSensorsComponent.cc): without them it shows two dialogs, opens Vehicle Setup, also in flight, and is "Not Ready" for
ever. They say what is known here; docs/ground-stations.md lists them. Some names would switch on further requests and
must not exist: FENCE_TOTAL, RALLY_TOTAL and COMPASS_PRIO1_ID (Mission Planner), FRAME_CLASS (QGroundControl).
"""

import math
from collections.abc import Mapping

from bridge.gcs.cost import Cost
from bridge.gcs.flash_budget import TOO_MANY_WRITES
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import LinkLost
from bridge.missions.fc_mission_store import AnyFcMissionStore, PushFailure
from bridge.missions.mission_service import MissionService
from bridge.model.refusal import Refusal
from bridge.model.vehicle import Health, Orientation, Readiness
from protocols.mavlink.codec import pack
from protocols.mavlink.dialect import Message, messages
from protocols.msp.inav import ARMING_BLOCKERS
from protocols.msp.mission import MAX_RADIUS_CM
from protocols.msp.telemetry import Sensor

_REAL32 = 9
#: Mission Planner's name for the radius in its plan screen; with this name it is in cm.
WP_RADIUS = "WPNAV_RADIUS"
SYSID = "SYSID_THISMAV"
#: RC_CHANNELS has the sticks in this order on every board.
_STICKS = ("ROLL", "PITCH", "THROTTLE", "YAW")
#: The range of MSP's channels, us. ArduPilot's defaults (1100, 1900, 1500) would mean that nothing is calibrated.
_CALIBRATION = {"MIN": 1000.0, "MAX": 2000.0, "TRIM": 1500.0}
#: No board tells its sensors' offsets in ArduPilot's units, so a value other than 0 only means "calibrated".
_ACCELEROMETER_OFFSET_M_S2, _COMPASS_OFFSET_MG = 0.001, 1.0
#: INAV's reasons not to arm.
_NO_ACCELEROMETER, _NO_COMPASS = ARMING_BLOCKERS[13], ARMING_BLOCKERS[12]


class Parameters:
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET. Values are REAL32."""

    def __init__(self, missions: MissionService, ground: Ground, sysid: int) -> None:
        self._missions = missions
        self._ground = ground
        self._sysid = sysid
        self._is_setting = False
        #: The values that stations know, once one has read them.
        self._told: dict[str, float] = {}

    def send_all(self, station: Station) -> None:
        """PARAM_REQUEST_LIST."""
        self._told = self._values()
        for name in self._told:
            if self._ground.allows(station, Cost.ANSWER):
                self._ground.to(station, _message(self._told, name))

    def follow(self) -> None:
        """Send the values that have changed to all stations, which keep a copy, once any has read them."""
        if self._told:
            before, self._told = self._told, self._values()
            for name, value in self._told.items():
                if before.get(name) != value:
                    self._ground.broadcast(_message(self._told, name))

    def send_one(self, station: Station, name: str, index: int) -> None:
        """PARAM_REQUEST_READ: by index, or by name where index is -1."""
        names = list(self._values())
        if index >= 0:
            name = names[index] if index < len(names) else ""
        self._send(station, name)

    def set(self, station: Station, name: str, value: float, now: float) -> None:
        """PARAM_SET: answered with the value then in force, as the protocol requires."""
        fc_store, radius_cm = self._missions.fc_store, self._values().get(WP_RADIUS)
        # Mission Planner keeps metres as text: 2.10 m arrives as 209.99998 cm.
        wanted_cm = round(value) if math.isfinite(value) else -1
        if name != WP_RADIUS or wanted_cm == radius_cm:
            # An equal value is not written: that would erase and rewrite the board's whole configuration.
            if name != WP_RADIUS and not math.isclose(self._values().get(name, value), value, rel_tol=1e-6):
                self._ground.say(Severity.ERROR, f"{name} is read-only", station)
            self._send(station, name)
            return
        if isinstance(fc_store, Refusal) or radius_cm is None:
            refusal = f"{WP_RADIUS} cannot be set on this flight controller now"
        elif not 0 <= wanted_cm <= MAX_RADIUS_CM:
            # No error: after each Write, Mission Planner sends its default of 30 m if its plan screen was open first.
            self._ground.say(Severity.NOTICE, f"{WP_RADIUS} stays {radius_cm:.0f}: 0..{MAX_RADIUS_CM} cm", station)
            self._send(station, name)
            return
        elif self._is_setting:
            # A change is pending; a station that requested another value repeats its request.
            return
        elif self._missions.armed_refusal() is not None:
            refusal = f"{WP_RADIUS} stays {radius_cm:.0f}: {PushFailure.ARMED.value}"
        elif not self._ground.allows_write(station, now):
            refusal = TOO_MANY_WRITES
        else:
            self._write(fc_store, wanted_cm, station, now)
            return
        self._ground.say(Severity.ERROR, refusal, station)
        self._send(station, name)

    def _write(self, fc_store: AnyFcMissionStore, wanted_cm: int, station: Station, now: float) -> None:
        def done(failure: PushFailure | LinkLost | None, _at: float) -> None:
            self._is_setting = False
            if failure is PushFailure.NO_ANSWER or isinstance(failure, LinkLost):
                self._ground.say(Severity.ERROR, f"No answer: {WP_RADIUS} may be set, read it again", station)
            elif failure is not None:
                self._ground.not_written(station)
                text = f"{WP_RADIUS} stays {fc_store.wp_radius_cm}: {failure.value}"
                self._ground.say(Severity.ERROR, text, station)
            self._send(station if failure else None, WP_RADIUS)

        self._is_setting = True
        self._missions.runner.start(fc_store.set_wp_radius(wanted_cm), done, now)

    def _values(self) -> dict[str, float]:
        """Every parameter. The radius is last: it is only known of some boards, and the others keep their indexes."""
        compass, accelerometer = self._sensors()
        values = {SYSID: float(self._sysid)}
        for channel, stick in enumerate(_STICKS, 1):
            values[f"RCMAP_{stick}"] = float(channel)
            values |= {f"RC{channel}_{kind}": value for kind, value in _CALIBRATION.items()}
        # Without an id QGroundControl makes no demands on the compass. No board needs it for arming.
        values |= {f"COMPASS_DEV_ID{number}": 0.0 for number in ("", "2", "3")}
        values |= {"COMPASS_USE": float(compass is not None), "COMPASS_USE2": 0.0, "COMPASS_USE3": 0.0}
        offsets = {
            "COMPASS_OFS": compass or 0.0,
            "COMPASS_OFS2": 0.0,
            "COMPASS_OFS3": 0.0,
            "INS_ACCOFFS": accelerometer,
        }
        values |= {f"{name}_{axis}": value for name, value in offsets.items() for axis in "XYZ"}
        fc_store = self._missions.fc_store
        if not isinstance(fc_store, Refusal) and fc_store.wp_radius_cm is not None:
            values[WP_RADIUS] = float(fc_store.wp_radius_cm)
        return values

    def _sensors(self) -> tuple[float | None, float]:
        """The offsets of the compass, None without one, and of the accelerometer; 0: not calibrated."""
        vehicle = self._missions.vehicle
        health, readiness, orientation = vehicle.last(Health), vehicle.last(Readiness), vehicle.last(Orientation)
        blockers = () if readiness is None else readiness.blockers
        is_fitted = health is not None and Sensor.COMPASS in health.sensors
        has_north = orientation is not None and orientation.is_north_known and _NO_COMPASS not in blockers
        return (
            _COMPASS_OFFSET_MG * has_north if is_fitted else None,
            0.0 if _NO_ACCELEROMETER in blockers else _ACCELEROMETER_OFFSET_M_S2,
        )

    def _send(self, station: Station | None, name: str) -> None:
        """Send PARAM_VALUE, or PARAM_ERROR without such a parameter; None: to all stations, which keep a copy."""
        values = self._values()
        if name not in values:
            self._refuse_unknown(station, name)
        elif station is None:
            self._ground.broadcast(_message(values, name))
            self._told |= {name: values[name]} if self._told else {}
        else:
            self._ground.to(station, _message(values, name))

    def _refuse_unknown(self, station: Station | None, name: str) -> None:
        """PARAM_ERROR, which MAVLink 1 lacks: without it MAVSDK waits 3 s."""
        if station is not None and name:
            unknown = messages.MAV_PARAM_ERROR_DOES_NOT_EXIST
            missing = messages.MAVLink_param_error_message(station.sysid, station.compid, name.encode(), -1, unknown)
            if (receiver := self._ground.station(station.peer)) is not None:
                self._ground.multicast(pack(missing), [receiver])


def _message(values: Mapping[str, float], name: str) -> Message:
    index = list(values).index(name)
    return messages.MAVLink_param_value_message(name.encode(), values[name], _REAL32, len(values), index)
