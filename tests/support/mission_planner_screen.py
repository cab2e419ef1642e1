# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts and speech of Mission Planner, as a pilot gets them.

Sources: CurrentState.cs, MAVLinkInterface.cs, HUD.cs, PrearmStatus.cs. Its defaults: severity 4, voice on, warnings of
a missing RC receiver on.
"""

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from tests.support.timeline import Timeline

_WORST_SHOWN = m.MAV_SEVERITY_WARNING
_LINE_LIFE_S = 10.0
_ALWAYS_SHOWN = ("Tuning:", "PreArm:", "Arm:")
_NOT_SPOKEN = "PreArm:"
#: The voice takes about this long for a character; meanwhile it takes no other text.
_SPEECH_S = 0.06
#: The line for the first of these that is present, enabled and not healthy.
_SENSOR_LINES = (
    (m.MAV_SYS_STATUS_SENSOR_GPS, "Unhealthy GPS Signal"),
    (m.MAV_SYS_STATUS_SENSOR_3D_GYRO, "Bad Gyro Health"),
    (m.MAV_SYS_STATUS_SENSOR_3D_ACCEL, "Bad Accel Health"),
    (m.MAV_SYS_STATUS_SENSOR_3D_MAG, "Bad Compass Health"),
    (m.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, "Bad Baro Health"),
    (m.MAV_SYS_STATUS_SENSOR_LASER_POSITION, "Bad LiDAR Health"),
    (m.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW, "Bad OptFlow Health"),
    (m.MAV_SYS_STATUS_SENSOR_VISION_POSITION, "Bad Vision Position"),
    (m.MAV_SYS_STATUS_TERRAIN, "Bad or No Terrain Data"),
    (m.MAV_SYS_STATUS_GEOFENCE, "Geofence Breach"),
    (m.MAV_SYS_STATUS_AHRS, "Unhealthy AHRS"),
    (m.MAV_SYS_STATUS_SENSOR_RC_RECEIVER, "NO RC Receiver"),
    (m.MAV_SYS_STATUS_SENSOR_BATTERY, "Bad Battery"),
    (m.MAV_SYS_STATUS_SENSOR_PROXIMITY, "Bad Proximity"),
    (m.MAV_SYS_STATUS_SENSOR_SATCOM, "Bad SatCom"),
    (m.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE, "Unhealthy Airspeed"),
)
_COPTER_MODES = {0: "Stabilize", 1: "Acro", 2: "AltHold", 3: "Auto", 4: "Guided", 5: "Loiter", 6: "RTL", 9: "Land"}
_PLANE_MODES = {0: "Manual", 2: "Stabilize", 4: "ACRO", 6: "FBWB", 7: "CRUISE", 10: "Auto", 11: "RTL", 12: "Loiter"}
_ROVER_MODES = {0: "Manual", 1: "Acro", 3: "Steering", 4: "Hold", 5: "Loiter", 10: "Auto", 11: "RTL"}


class MissionPlannerScreen:
    """Fed with every message of the vehicle in the order of time. Every query takes a time."""

    def __init__(self) -> None:
        #: messageHigh: the one line on the HUD.
        self.line = Timeline("", _LINE_LIFE_S)
        self.armed = Timeline(False)
        #: FAILSAFE in red across the HUD.
        self.failsafe = Timeline(False)
        #: SAFE in red across the HUD: the motor outputs are not enabled.
        self.safe = Timeline(False)
        self.mode = Timeline("Unknown")
        #: "Ready to Arm" or "Not Ready to Arm" while disarmed.
        self.ready = Timeline(True)
        #: Everything the voice has said.
        self.spoken: list[tuple[float, str]] = []
        #: The Messages tab.
        self.messages: list[tuple[float, str]] = []
        self._prearm_requests: list[float] = []
        self._knows_sensors = False
        self._motors_enabled = False
        self._quiet_at = self._spoken_until = 0.0
        self._last_spoken_line = ""

    # Fed by the test.

    def take(self, at: float, message: Message) -> None:
        """A message from the vehicle."""
        self._speak_the_line(at)
        match message.get_type():
            case "STATUSTEXT":
                self._text(at, message.severity, message.text.split("\0")[0].rstrip(" "))
            case "SYS_STATUS":
                self._sensors(at, message)
            case "HEARTBEAT" if message.type != m.MAV_TYPE_GCS:
                self._heartbeat(at, message)

    def asked_for_prearm_checks(self, at: float) -> None:
        """Its PreArm window has sent RUN_PREARM_CHECKS, as it does when opened and every 5 s while not ready."""
        self._prearm_requests.append(at)

    # What the pilot reads.

    def hud(self, at: float) -> str:
        """The line on the HUD."""
        return self.line.at(at)

    def prearm_window(self, at: float) -> list[str]:
        """The lines of the PreArm window."""
        if self.ready.at(at):
            return ["Ready to Arm"]
        # The answers to the last request get a second to arrive.
        sent = [0.0, *(sent for sent in self._prearm_requests if sent < at - 1.0)]
        reasons = [text for when, text in self.messages if sent[-1] < when <= at and text.lower().startswith("prearm:")]
        return list(dict.fromkeys(reasons)) or ["Prearm checks failing", "Waiting for error messages..."]

    def texts(self, since: float = 0.0) -> list[str]:
        """The Messages tab."""
        return [text for at, text in self.messages if at >= since]

    def heard(self, since: float = 0.0) -> list[str]:
        """What the voice has said, without its repetitions."""
        return list(dict.fromkeys(text for at, text in self.spoken if at >= since))

    # Its rules.

    def _text(self, at: float, severity: int, text: str) -> None:
        self.messages.append((at, text))
        if severity > _WORST_SHOWN and not text.startswith(_ALWAYS_SHOWN):
            return
        self._show(at, text)
        if not text.startswith(_NOT_SPOKEN):
            self._say(at, text)

    def _sensors(self, at: float, message: Message) -> None:
        self._knows_sensors = True
        enabled, health = message.onboard_control_sensors_enabled, message.onboard_control_sensors_health
        bad = message.onboard_control_sensors_present & enabled & ~health
        self._motors_enabled = bool(enabled & m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS)
        self.safe.set(at, not self._motors_enabled)
        prearm = m.MAV_SYS_STATUS_PREARM_CHECK
        self.ready.set(at, bool(health & prearm) or not enabled & prearm)
        if message.errors_count1 or message.errors_count2:
            self._show(at, f"InternalError 0x{message.errors_count1 + (message.errors_count2 << 16):X}")
        if bad & prearm:
            reasons = [text for _, text in self.messages if "prearm" in text.lower()]
            self._show(at, reasons[-1] if reasons else "")
        else:
            self._show(at, next((line for bit, line in _SENSOR_LINES if bad & bit), ""))

    def _heartbeat(self, at: float, message: Message) -> None:
        armed = bool(message.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED)
        self.armed.set(at, armed)
        if armed and self._knows_sensors and not self._motors_enabled:
            self._show(at, "(SAFETY)")
        self.failsafe.set(at, message.system_status == m.MAV_STATE_CRITICAL)
        modes = _COPTER_MODES
        if message.type == m.MAV_TYPE_FIXED_WING:
            modes = _PLANE_MODES
        elif message.type in (m.MAV_TYPE_GROUND_ROVER, m.MAV_TYPE_SURFACE_BOAT):
            modes = _ROVER_MODES
        if message.custom_mode in modes:
            self.mode.set(at, modes[message.custom_mode])

    def _show(self, at: float, text: str) -> None:
        """A text that is still shown is not renewed."""
        if text and self.line.at(at) != text:
            self.line.set(at, text)

    def _say(self, at: float, text: str) -> None:
        """A text that arrives while the voice speaks is not said."""
        if at >= self._quiet_at:
            self.spoken.append((at, text))
            self._quiet_at = at + _SPEECH_S * len(text)

    def _speak_the_line(self, until: float) -> None:
        """Whenever the voice is quiet, it says the line, if that is another one than it said last."""
        while (at := max(self._quiet_at, self._spoken_until)) < until:
            line = self.line.at(at)
            if line != self._last_spoken_line and not line.startswith(_NOT_SPOKEN):
                self._last_spoken_line = line
                if line:
                    self._say(at, line)
                    continue
            # Until the next message the line can only end.
            ends = self.line.changes[-1][0] + _LINE_LIFE_S if line else until
            self._spoken_until = min(until, max(ends, at) + 1e-3)
