# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts and speech of QGroundControl (commit c15cc3204 of February 2026) for an ArduPilot, as a pilot gets them.

Sources: Vehicle::_textMessageReceived, _errorMessageReceived, _handleSysStatus and _handleExtendedSysState,
APMFirmwarePlugin::_handleIncomingHeartbeat, VehicleLinkManager::mavlinkMessageReceived, MainStatusIndicator.qml,
VehicleWarnings.qml, QGCApplication::showCriticalVehicleMessage, PlanManager::_handleMissionAck; AutoPilotPlugin.cc,
APMRadioComponent.cc and APMSensorsComponent.cc of 5.0.

Only its rules, not its requests: a scripted client passes those it sends to `sent`.
"""

from math import inf

from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.dialect import Message
from tests.support.timeline import Timeline

_COMMUNICATION_LOST_S = 3.5
_PREARM_ERROR_LIFE_S = 35.0
_PREARM_QUIET_S = 10.0
_STICKS = ("ROLL", "PITCH", "YAW", "THROTTLE")
_OFFSETS = tuple(f"COMPASS_OFS{number}_" for number in ("", "2", "3"))
_AXES = "XYZ"
_CALIBRATION = {"MIN": 1100, "MAX": 1900, "TRIM": 1500}
#: The parameters that it reads from every ArduPilot vehicle; a missing one is reported and counts as 0.
_NEEDED = (
    *(f"RCMAP_{stick}" for stick in _STICKS),
    *(f"COMPASS_DEV_ID{number}" for number in ("", "2", "3")),
    *(f"COMPASS_USE{number}" for number in ("", "2", "3")),
    *(prefix + axis for prefix in _OFFSETS for axis in _AXES),
    *(f"INS_ACCOFFS_{axis}" for axis in _AXES),
)
MISSING = "Parameters are missing from firmware."
NEEDS_SETUP = "One or more vehicle components require setup prior to flight."
_RESULTS = {
    m.MAV_MISSION_ERROR: "Unspecified error.",
    m.MAV_MISSION_UNSUPPORTED_FRAME: "Coordinate frame is not supported.",
    m.MAV_MISSION_UNSUPPORTED: "Command is not supported.",
    m.MAV_MISSION_NO_SPACE: "Mission item exceeds storage space.",
    m.MAV_MISSION_INVALID: "One of the parameters has an invalid value.",
    **{m.MAV_MISSION_INVALID_PARAM1 + index: f"Param {index + 1} invalid value." for index in range(7)},
    m.MAV_MISSION_DENIED: "Not accepting any mission commands.",
}


class QgcScreen:
    """Fed with every message of the vehicle in the order of time. Every query takes a time."""

    def __init__(self) -> None:
        #: The version in which it speaks over UDP: that of the vehicle's first packet.
        self.mavlink_version: int | None = None
        self.dialogs: list[tuple[float, str]] = []
        #: Texts of severity ERROR or worse, over the map until the pilot closes them; the next ones wait behind.
        self.banners: list[tuple[float, str]] = []
        #: True once it has left the map for Vehicle Setup.
        self.is_in_setup = False
        self.spoken: list[tuple[float, str]] = []
        self.messages: list[tuple[float, str]] = []
        #: The reason not to arm, over the map.
        self.prearm_error = Timeline("", _PREARM_ERROR_LIFE_S)
        self.armed = Timeline(False)
        self.flying = Timeline(False)
        self.parameters: dict[str, float] = {}
        self._components_ok: bool | None = None
        self._prearm_spoken: dict[str, float] = {}
        self._sensors_ok = Timeline(True)
        self._ready: Timeline[bool | None] = Timeline(None)
        self._heard_at: list[float] = []
        self._chunks: dict[int, tuple[int, dict[int, str]]] = {}
        self._transfer: str | None = None

    # Fed by the test.

    def take(self, at: float, message: Message) -> None:
        """A message from the vehicle."""
        if self.mavlink_version is None:
            self.mavlink_version = 2 if message.get_msgbuf()[0] == 0xFD else 1
        if message.get_type() != "RADIO_STATUS":
            self._heard_at.append(at)
        match message.get_type():
            case "HEARTBEAT" if message.type != m.MAV_TYPE_GCS:
                self._heartbeat(at, message)
            case "EXTENDED_SYS_STATE" if message.landed_state != m.MAV_LANDED_STATE_UNDEFINED:
                self.flying.set(at, message.landed_state == m.MAV_LANDED_STATE_IN_AIR)
            case "SYS_STATUS":
                self._sensors(at, message)
            case "STATUSTEXT":
                self._chunk(at, message)
            case "PARAM_VALUE":
                self._parameter(at, message)
            case "MISSION_COUNT" if self._transfer == "read":
                self._transfer = "items" if message.count else None
            case "MISSION_ACK" if self._transfer is not None:
                self._ack(at, message)

    def sent(self, message: Message) -> None:
        """A message from it to the vehicle."""
        kinds = {"MISSION_COUNT": "write", "MISSION_REQUEST_LIST": "read", "MISSION_CLEAR_ALL": "clear"}
        kind = message.get_type()
        if kind in kinds and message.mission_type == m.MAV_MISSION_TYPE_MISSION:
            self._transfer = kinds[kind]
        elif kind == "MISSION_ACK":
            self._transfer = None

    # What the pilot reads.

    def status(self, at: float) -> str:
        """The text at the left of the toolbar."""
        heard = max((when for when in self._heard_at if when <= at), default=-inf)
        if heard == -inf:
            return "Disconnected"
        if at > heard + _COMMUNICATION_LOST_S:
            return "Comms Lost"
        if self.armed.at(at):
            return "Flying" if self.flying.at(at) else "Armed"
        ready = self._ready.at(at)
        if ready is None:
            ready = self._sensors_ok.at(at) and self._components_ok is True
        return "Ready" if ready else "Not Ready"

    def texts(self, since: float = 0.0) -> list[str]:
        return [text for at, text in self.messages if at >= since]

    def heard(self, since: float = 0.0) -> list[str]:
        """What it has read aloud."""
        return [text for at, text in self.spoken if at >= since]

    # Its rules.

    def _heartbeat(self, at: float, message: Message) -> None:
        armed = bool(message.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED)
        self.armed.set(at, armed)
        # Also in CRITICAL; 5.0 took only a craft that flew before for flying then.
        in_the_air = (m.MAV_STATE_ACTIVE, m.MAV_STATE_CRITICAL, m.MAV_STATE_EMERGENCY)
        self.flying.set(at, armed and message.system_status in in_the_air)

    def _sensors(self, at: float, message: Message) -> None:
        enabled, health = message.onboard_control_sensors_enabled, message.onboard_control_sensors_health
        # Without the bit the last answer stays.
        if enabled & m.MAV_SYS_STATUS_PREARM_CHECK:
            self._ready.set(at, bool(health & m.MAV_SYS_STATUS_PREARM_CHECK))
        self._sensors_ok.set(at, enabled & health == enabled)

    def _chunk(self, at: float, message: Message) -> None:
        """Pieces with the same id are joined; a piece that is not full ends the text."""
        identity, number = getattr(message, "id", 0), getattr(message, "chunk_seq", 0)
        if not identity:
            self._text(at, message.severity, message.text)
            return
        _, pieces = self._chunks.setdefault(identity, (message.severity, {}))
        pieces[number] = message.text
        if len(message.text) < 50:
            del self._chunks[identity]
            self._text(at, message.severity, "".join(pieces.get(each, " ... ") for each in range(number + 1)))

    def _text(self, at: float, severity: int, text: str) -> None:
        is_prearm, is_said = text.startswith("PreArm"), severity <= m.MAV_SEVERITY_NOTICE
        if is_prearm:
            if at < self._prearm_spoken.get(text, -inf) + _PREARM_QUIET_S:
                is_said = False
            else:
                self._prearm_spoken[text] = at
                self.prearm_error.set(at, text)
        if is_said:
            self.spoken.append((at, text))
        self.messages.append((at, text))
        if severity <= m.MAV_SEVERITY_ERROR and not is_prearm:
            self.banners.append((at, text))

    def _parameter(self, at: float, message: Message) -> None:
        self.parameters[message.param_id] = message.param_value
        if len(self.parameters) == message.param_count and self._components_ok is None:
            self._check_components(at)

    def _check_components(self, at: float) -> None:
        missing = [name for name in (*_NEEDED, *self._channel_parameters()) if name not in self.parameters]
        if missing:
            self.dialogs.append((at, f"{MISSING} Missing params: {', '.join(missing)}"))
        self._components_ok = self._is_radio_set_up() and not self._needs_compass() and not self._needs_accelerometer()
        if not self._components_ok:
            self.dialogs.append((at, NEEDS_SETUP))
            self.is_in_setup = True

    def _value(self, name: str) -> float:
        return self.parameters.get(name, 0.0)

    def _channel_parameters(self) -> list[str]:
        channels = [int(self._value(f"RCMAP_{stick}")) for stick in _STICKS]
        return [f"RC{channel}_{kind}" for channel in channels if channel for kind in _CALIBRATION]

    def _is_radio_set_up(self) -> bool:
        """All sticks are mapped, and not every value is a default."""
        if any(self._value(f"RCMAP_{stick}") <= 0 for stick in _STICKS):
            return False
        return any(int(self._value(name)) != _CALIBRATION[name.split("_")[1]] for name in self._channel_parameters())

    def _needs_compass(self) -> bool:
        return any(
            self._value(f"COMPASS_DEV_ID{number}")
            and self._value(f"COMPASS_USE{number}")
            and not all(self._value(prefix + axis) for axis in _AXES)
            for number, prefix in zip(("", "2", "3"), _OFFSETS, strict=True)
        )

    def _needs_accelerometer(self) -> bool:
        return not any(self._value(f"INS_ACCOFFS_{axis}") for axis in _AXES)

    def _ack(self, at: float, message: Message) -> None:
        if getattr(message, "mission_type", 0) != m.MAV_MISSION_TYPE_MISSION:
            return
        if message.type == m.MAV_MISSION_INVALID_SEQUENCE:
            return
        if message.type != m.MAV_MISSION_ACCEPTED:
            self.dialogs.append((at, _RESULTS.get(message.type, f"Unknown error: {message.type}.")))
        self._transfer = None
