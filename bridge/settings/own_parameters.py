# SPDX-License-Identifier: GPL-3.0-or-later
"""The short list of parameters that ground stations need to see on every board.

QGroundControl reads those of receiver, compass and accelerometer once when it connects (APMRadioComponent.cc,
APMSensorsComponent.cc): without them it shows two dialogs, opens Vehicle Setup, also in flight, and is "Not Ready" for
ever. They say what is known here; docs/ground-stations.md lists them. Some names would switch on further requests and
must not exist: FENCE_TOTAL, RALLY_TOTAL and COMPASS_PRIO1_ID (Mission Planner), FRAME_CLASS (QGroundControl).
"""

import math
from collections.abc import Callable

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.gcs.cost import TOO_MANY_WRITES, Cost
from bridge.gcs.ground import Ground
from bridge.gcs.station import Station
from bridge.line.conversation import LinkLost
from bridge.missions.fc_mission_store import AnyFcMissionStore, PushFailure
from bridge.missions.mission_service import MissionService
from bridge.model.refusal import Refusal
from bridge.model.vehicle import Health, Orientation, Readiness
from bridge.settings.board_settings import BoardSettings
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
#: Not known, or set by `values`.
_ZERO = (
    "COMPASS_DEV_ID", "COMPASS_DEV_ID2", "COMPASS_DEV_ID3", "COMPASS_USE", "COMPASS_USE2", "COMPASS_USE3",
    *(f"{name}_{axis}" for name in ("COMPASS_OFS", "COMPASS_OFS2", "COMPASS_OFS3", "INS_ACCOFFS") for axis in "XYZ"),
)  # fmt: skip
#: INAV's reasons not to arm.
_NO_ACCELEROMETER, _NO_COMPASS = ARMING_BLOCKERS[13], ARMING_BLOCKERS[12]
#: Called with the reason if it was not set.
OnSet = Callable[[SettingRefusal | None, float], None]


class OwnParameters:
    """Their values, and the one that can be set."""

    def __init__(self, missions: MissionService, settings: BoardSettings, ground: Ground, sysid: int) -> None:
        self._missions = missions
        self._settings = settings
        self._ground = ground
        self._constant = {SYSID: float(sysid)}
        for channel, stick in enumerate(_STICKS, 1):
            self._constant[f"RCMAP_{stick}"] = float(channel)
            self._constant |= {f"RC{channel}_{kind}": value for kind, value in _CALIBRATION.items()}
        # Without an id QGroundControl makes no demands on the compass. No board needs it for arming.
        self._constant |= dict.fromkeys(_ZERO, 0.0)
        self._is_setting = False

    def set(self, station: Station, name: str, value: float, now: float, done: OnSet) -> bool:
        """PARAM_SET of one of them; False if it holds the value already, or does not exist."""
        fc_store, held = self._missions.fc_store, self.values().get(name)
        # Mission Planner keeps metres as text: 2.10 m arrives as 209.99998 cm.
        wanted_cm = round(value) if math.isfinite(value) else -1
        if name != WP_RADIUS:
            if held is None or math.isclose(held, value, rel_tol=1e-6):
                return False
            done(SettingRefusal(Cause.FIXED, f"{name} is read-only"), now)
        elif isinstance(fc_store, Refusal) or held is None:
            done(SettingRefusal(Cause.NO_LINK, f"{name} cannot be set on this flight controller now"), now)
        elif wanted_cm == held:
            # An equal value is not written: that would erase and rewrite the board's whole configuration.
            return False
        elif not 0 <= wanted_cm <= MAX_RADIUS_CM:
            done(SettingRefusal(Cause.OUT_OF_RANGE, f"{name} stays {held:.0f}: 0..{MAX_RADIUS_CM} cm"), now)
        elif self._is_setting:
            # A change is pending; a station that requested another value repeats its request.
            pass
        elif self._missions.armed_refusal() is not None:
            done(SettingRefusal(Cause.ARMED, f"{name} stays {held:.0f}: {PushFailure.ARMED.value}"), now)
        elif not self._ground.allows(station, Cost.FLASH):
            done(SettingRefusal(Cause.LIMIT, TOO_MANY_WRITES), now)
        else:
            self._write(fc_store, wanted_cm, station, now, done)
        return True

    def _write(self, fc_store: AnyFcMissionStore, wanted_cm: int, station: Station, now: float, done: OnSet) -> None:
        def written(failure: PushFailure | LinkLost | None, at: float) -> None:
            self._is_setting = False
            self._settings.saved_with_mission(at)
            if failure is None:
                done(None, at)
            elif failure is PushFailure.NO_ANSWER or isinstance(failure, LinkLost):
                text = f"No answer: {WP_RADIUS} may be set, read it again"
                done(SettingRefusal(Cause.NO_ANSWER, text), at)
            else:
                self._ground.not_written(station)
                text = f"{WP_RADIUS} stays {fc_store.wp_radius_cm}: {failure.value}"
                done(SettingRefusal(Cause.REFUSED, text), at)

        self._is_setting = True
        self._missions.runner.start(fc_store.set_wp_radius(wanted_cm), written, now)

    def values(self) -> dict[str, float]:
        """All of them. The radius is last: it is only known of some boards, and the others keep their indexes."""
        compass, accelerometer = self._sensors()
        values = dict(self._constant)
        values["COMPASS_USE"] = float(compass is not None)
        values["COMPASS_OFS_X"] = values["COMPASS_OFS_Y"] = values["COMPASS_OFS_Z"] = compass or 0.0
        values["INS_ACCOFFS_X"] = values["INS_ACCOFFS_Y"] = values["INS_ACCOFFS_Z"] = accelerometer
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
