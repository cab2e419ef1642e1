# SPDX-License-Identifier: GPL-3.0-or-later
"""The short list of parameters that ground stations need to see on every board.

QGroundControl reads those of receiver, compass and accelerometer once when it connects (APMRadioComponent.cc,
APMSensorsComponent.cc): without them it shows two dialogs, opens Vehicle Setup, also in flight, and is "Not Ready" for
ever. They say what is known here; docs/ground-stations.md lists them. Some names would switch on further requests and
must not exist: FENCE_TOTAL, RALLY_TOTAL and COMPASS_PRIO1_ID (Mission Planner), FRAME_CLASS (QGroundControl).
"""

from bridge.model.vehicle import Health, Orientation, Readiness, Vehicle
from protocols.msp.inav import ARMING_BLOCKERS
from protocols.msp.telemetry import Sensor

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


class OwnParameters:
    """Their values. None can be set."""

    def __init__(self, vehicle: Vehicle, sysid: int) -> None:
        self._vehicle = vehicle
        self._constant = {SYSID: float(sysid)}
        for channel, stick in enumerate(_STICKS, 1):
            self._constant[f"RCMAP_{stick}"] = float(channel)
            self._constant |= {f"RC{channel}_{kind}": value for kind, value in _CALIBRATION.items()}
        # Without an id QGroundControl makes no demands on the compass. No board needs it for arming.
        self._constant |= dict.fromkeys(_ZERO, 0.0)

    def values(self) -> dict[str, float]:
        """All of them."""
        compass, accelerometer = self._sensors()
        values = dict(self._constant)
        values["COMPASS_USE"] = float(compass is not None)
        values["COMPASS_OFS_X"] = values["COMPASS_OFS_Y"] = values["COMPASS_OFS_Z"] = compass or 0.0
        values["INS_ACCOFFS_X"] = values["INS_ACCOFFS_Y"] = values["INS_ACCOFFS_Z"] = accelerometer
        return values

    def _sensors(self) -> tuple[float | None, float]:
        """The offsets of the compass, None without one, and of the accelerometer; 0: not calibrated."""
        vehicle = self._vehicle
        health, readiness, orientation = vehicle.last(Health), vehicle.last(Readiness), vehicle.last(Orientation)
        blockers = () if readiness is None else readiness.blockers
        is_fitted = health is not None and Sensor.COMPASS in health.sensors
        has_north = orientation is not None and orientation.is_north_known and _NO_COMPASS not in blockers
        return (
            _COMPASS_OFFSET_MG * has_north if is_fitted else None,
            0.0 if _NO_ACCELEROMETER in blockers else _ACCELEROMETER_OFFSET_M_S2,
        )
