# SPDX-License-Identifier: GPL-3.0-or-later
"""The short list of parameters that ground stations need to see on every board.

QGroundControl reads those of receiver, compass and accelerometer once when it connects (APMRadioComponent.cc,
APMSensorsComponent.cc): without them it shows two dialogs, opens Vehicle Setup, also in flight, and is "Not Ready" for
ever. They say what is known here; docs/ground-stations.md lists them. Some names would switch on further requests and
must not exist: FENCE_TOTAL, RALLY_TOTAL and COMPASS_PRIO1_ID (Mission Planner), FRAME_CLASS (QGroundControl).
"""

import math
from collections.abc import Callable

from bridge.gcs.cost import TOO_MANY_WRITES, Cost
from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import LinkLost
from bridge.missions.fc_mission_store import AnyFcMissionStore, PushFailure
from bridge.missions.mission_service import MissionService
from bridge.model.refusal import Refusal
from bridge.model.vehicle import Health, Orientation, Readiness
from protocols.msp.inav import ARMING_BLOCKERS
from protocols.msp.mission import MAX_RADIUS_CM
from protocols.msp.telemetry import Sensor

#: Mission Planner's name for the radius in its plan screen; with this name it is in cm.
WP_RADIUS = "WPNAV_RADIUS"
SYSID = "SYSID_THISMAV"
#: RC_CHANNELS has the sticks in this order on every board.
_STICKS = ("ROLL", "PITCH", "THROTTLE", "YAW")
#: The range of MSP's channels, us. ArduPilot's defaults (1100, 1900, 1500) would mean that nothing is calibrated.
_CALIBRATION = {"MIN": 1000.0, "MAX": 2000.0, "TRIM": 1500.0}
#: No board reports its sensors' offsets in ArduPilot's units, so a value other than 0 only means "calibrated".
_ACCELEROMETER_OFFSET_M_S2, _COMPASS_OFFSET_MG = 0.001, 1.0
#: INAV's reasons not to arm.
_NO_ACCELEROMETER, _NO_COMPASS = ARMING_BLOCKERS[13], ARMING_BLOCKERS[12]


#: Sends the present value to one station, or to all.
Send = Callable[[Station | None], None]


class OwnParameters:
    """Their values, and the one that can be set. `on_radius_set`: called when the board has another radius."""

    def __init__(self, missions: MissionService, ground: Ground, sysid: int) -> None:
        self._missions = missions
        self._ground = ground
        self._sysid = sysid
        self._is_setting = False
        self.on_radius_set: Callable[[float], None] = lambda _now: None

    def set(self, station: Station, name: str, value: float, now: float, send: Send) -> None:
        """PARAM_SET of one of them, or of an unknown name."""
        fc_store, radius_cm = self._missions.fc_store, self.values().get(WP_RADIUS)
        # Mission Planner keeps metres as text: 2.10 m arrives as 209.99998 cm.
        wanted_cm = round(value) if math.isfinite(value) else -1
        if name != WP_RADIUS or wanted_cm == radius_cm:
            # An equal value is not written: that would erase and rewrite the board's whole configuration.
            if name != WP_RADIUS and not math.isclose(self.values().get(name, value), value, rel_tol=1e-6):
                self._ground.say(Severity.ERROR, f"{name} is read-only", station)
            send(station)
            return
        if isinstance(fc_store, Refusal) or radius_cm is None:
            refusal = f"{WP_RADIUS} cannot be set on this flight controller now"
        elif not 0 <= wanted_cm <= MAX_RADIUS_CM:
            # No error: after each Write, Mission Planner sends its default of 30 m if its plan screen was open first.
            self._ground.say(Severity.NOTICE, f"{WP_RADIUS} stays {radius_cm:.0f}: 0..{MAX_RADIUS_CM} cm", station)
            send(station)
            return
        elif self._is_setting:
            # A change is pending; a station that requested another value repeats its request.
            return
        elif self._missions.armed_refusal() is not None:
            refusal = f"{WP_RADIUS} stays {radius_cm:.0f}: {PushFailure.ARMED.value}"
        elif not self._ground.allows(station, Cost.FLASH):
            refusal = TOO_MANY_WRITES
        else:
            self._write(fc_store, wanted_cm, station, now, send)
            return
        self._ground.say(Severity.ERROR, refusal, station)
        send(station)

    def _write(self, fc_store: AnyFcMissionStore, wanted_cm: int, station: Station, now: float, send: Send) -> None:
        def done(failure: PushFailure | LinkLost | None, at: float) -> None:
            self._is_setting = False
            if failure is PushFailure.NO_ANSWER or isinstance(failure, LinkLost):
                self._ground.say(Severity.ERROR, f"No answer: {WP_RADIUS} may be set, read it again", station)
            elif failure is not None:
                self._ground.not_written(station)
                text = f"{WP_RADIUS} stays {fc_store.wp_radius_cm}: {failure.value}"
                self._ground.say(Severity.ERROR, text, station)
            self.on_radius_set(at)
            send(station if failure else None)

        self._is_setting = True
        self._missions.runner.start(fc_store.set_wp_radius(wanted_cm), done, now)

    def values(self) -> dict[str, float]:
        """All of them. The radius is last: it is only known of some boards, and the others keep their indexes."""
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
