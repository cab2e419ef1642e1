# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink parameters: the bridge's own, and every setting of the flight controller. Values are REAL32, as ArduPilot's.

Names are in upper case, as MAVProxy and DroneKit send all names. A name is recognised in any case.

https://mavlink.io/en/services/parameter.html

Ground stations keep the number of parameters that they heard first, so a list waits until the settings were read, and
is sent again to the stations that had got a shorter one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from math import inf, isclose, isfinite
from weakref import WeakKeyDictionary

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.model.settings import BoardSetting, SettingTable, ValueKind, shown
from bridge.model.vehicle import Health, Orientation, Readiness, Vehicle
from bridge.settings.board_settings import BoardSettings
from bridge.settings.parameter_names import parameter_names
from bridge.settings.setting_work import Answer
from bridge.voice import sentences
from bridge.voice.happening import Happening
from bridge.voice.stations import Kind
from protocols.float32 import single
from protocols.mavlink.codec import pack
from protocols.mavlink.dialect import Message, messages
from protocols.msp.inav import ARMING_BLOCKERS
from protocols.msp.telemetry import Sensor

_REAL32 = 9
SYSID = "SYSID_THISMAV"
#: RC_CHANNELS has the sticks in this order on every board.
_STICKS = ("ROLL", "PITCH", "THROTTLE", "YAW")
#: The range of MSP's channels, us. ArduPilot's defaults (1100, 1900, 1500) would mean that nothing is calibrated.
_CALIBRATION = {"MIN": 1000.0, "MAX": 2000.0, "TRIM": 1500.0}
#: No board reports the sensors' offsets in ArduPilot's units, so a value other than 0 only means "calibrated".
_ACCELEROMETER_OFFSET_M_S2, _COMPASS_OFFSET_MG = 0.001, 1.0
#: Not known, or set by `values`.
_ZERO = (
    "COMPASS_DEV_ID", "COMPASS_DEV_ID2", "COMPASS_DEV_ID3", "COMPASS_USE", "COMPASS_USE2", "COMPASS_USE3",
    *(f"{name}_{axis}" for name in ("COMPASS_OFS", "COMPASS_OFS2", "COMPASS_OFS3", "INS_ACCOFFS") for axis in "XYZ"),
)  # fmt: skip
#: INAV's reasons not to arm.
_NO_ACCELEROMETER, _NO_COMPASS = ARMING_BLOCKERS[13], ARMING_BLOCKERS[12]
#: Mission Planner's name for the radius in the plan screen, in cm, and a Harakiri's setting.
WP_RADIUS, _RADIUS = "WPNAV_RADIUS", "GPS_WP_RADIUS"
#: 500 parameters a second for all lists together: a radio at 57600 baud carries as many.
_EACH, _INTERVAL_S = 10, 0.02
#: QGroundControl repeats its request after 5 s, Mission Planner after 4 s.
_LIST_WITHIN_S = 3.5
#: Above this, REAL32 cannot represent every whole number.
_MOST_EXACT = 2**24
_ERRORS = {
    Cause.OUT_OF_RANGE: messages.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE,
    Cause.FIXED: messages.MAV_PARAM_ERROR_READ_ONLY,
    Cause.ARMED: messages.MAV_PARAM_ERROR_PERMISSION_DENIED,
}


class OwnParameters:
    """Their values. None can be set."""

    def __init__(self, vehicle: Vehicle, sysid: int) -> None:
        self._vehicle = vehicle
        self._constant = {SYSID: float(sysid)}
        for channel, stick in enumerate(_STICKS, 1):
            self._constant[f"RCMAP_{stick}"] = float(channel)
            self._constant |= {f"RC{channel}_{kind}": value for kind, value in _CALIBRATION.items()}
        # Without an id QGroundControl does not make demands on the compass. No board needs it for arming.
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


@dataclass(slots=True)
class _Dialogue:
    """The parameters sent to a sender. next: the index in the list being sent, or None. count: of the last list."""

    next: int | None = None
    count: int = 0
    awaits_list: bool = False


class Parameters:
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET."""

    def __init__(self, own: OwnParameters, settings: BoardSettings, ground: Ground) -> None:
        self._own = own
        self._settings = settings
        self._ground = ground
        #: The table that the following come from, and the one that stations know.
        self._table: SettingTable | None = None
        self.followed: SettingTable | None = None
        #: The settings that are numbers, and their names, by parameter.
        self._named: Mapping[str, BoardSetting] = {}
        self._held: dict[str, float] = {}
        self._names: Mapping[str, str] = {}
        #: The values that stations know, once one has read them.
        self._told: dict[str, float] = {}
        self._dialogues: WeakKeyDictionary[Sender, _Dialogue] = WeakKeyDictionary()
        #: The time of the next `tick`, or infinity unless a list is being sent.
        self.due = inf
        #: True if the last PARAM_SET was refused: Mission Planner then asks for a save all the same.
        self.was_refused = False

    def request_list(self, sender: Sender, now: float) -> None:
        """PARAM_REQUEST_LIST."""
        dialogue = self._dialogue(sender)
        if dialogue.awaits_list or not sender.station.allows(Cost.LIST):
            return
        dialogue.awaits_list = True

        def done(table: SettingTable | SettingRefusal, at: float) -> None:
            if isinstance(table, SettingRefusal) and table.cause is Cause.NO_ANSWER:
                sender.say(sentences.LIST_UNANSWERED())
            dialogue.awaits_list, dialogue.next = False, 0
            self.due = min(self.due, at)

        self._settings.current(done, now, _LIST_WITHIN_S)

    def send_one(self, sender: Sender, name: str, index: int, now: float) -> None:
        """PARAM_REQUEST_READ: by index, or by name where index is -1."""
        values = self._values()
        if index >= 0:
            name = next(islice(values, index, None), "")
        if index >= 0 or name.upper() in values or self._settings.known.table is not None:
            self._send(sender, name)
            return

        def done(table: SettingTable | SettingRefusal, _at: float) -> None:
            if not isinstance(table, SettingRefusal) or table.cause is not Cause.OCCUPIED:
                self._send(sender, name)

        self._settings.current(done, now, _LIST_WITHIN_S)

    def set(self, sender: Sender, name: str, value: float, now: float) -> None:
        """PARAM_SET: answered once, with the value that is then in force, as the protocol requires."""
        parameter, values = name.upper(), self._values()
        self.was_refused = parameter not in values
        setting = self._named.get(_RADIUS if parameter == WP_RADIUS else parameter)
        if parameter == WP_RADIUS and isfinite(value):
            value = float(round(value))  # Mission Planner keeps metres as text: 2.10 m arrives as 209.99998 cm

        def done(result: Answer, _at: float) -> None:
            if isinstance(result, SettingRefusal):
                self.refuse(
                    sender, name, replace(result, why=result.why.renamed(setting.name if setting else "", parameter))
                )
                return
            if not self._told:
                self._ground.broadcast(self._message(parameter))
            if name != parameter:
                self._send(sender, name)

        if setting is None and not isclose(value, values.get(parameter, value), rel_tol=1e-6):
            self.refuse(sender, name, SettingRefusal(Cause.FIXED, sentences.READ_ONLY(parameter)))
        elif (
            setting is None
            or value == setting.value
            or (abs(value) >= _MOST_EXACT and value == single(float(setting.value)))
        ):
            self._send(sender, name)
        elif setting.kind is ValueKind.INTEGER and setting.accepts(value) and abs(value) >= _MOST_EXACT:
            above = sentences.STAYS(parameter, shown(setting.value), f"only up to {_MOST_EXACT - 1} over MAVLink")
            self.refuse(sender, name, SettingRefusal(Cause.OUT_OF_RANGE, above))
        else:
            self._settings.change(setting.name, value, done, now, str(sender))

    def refuse(self, sender: Sender, name: str, refused: SettingRefusal | None = None) -> None:
        """Send the reason, then the value in force. PARAM_ERROR, which MAVLink 1 lacks, spares MAVSDK a wait.

        refused: None if the station has been told the reason.
        """
        self.was_refused = True
        cause = Cause.ARMED if refused is None else refused.cause
        if refused is not None:
            # Each Write in Mission Planner sends the default radius of 30 m if the plan screen was open first.
            is_routine = name.upper() == WP_RADIUS and cause is Cause.OUT_OF_RANGE
            sender.say(Happening(sentences.RADIUS_KEPT, refused.why.values) if is_routine else refused.why)
        if name.upper() in self._values():
            self._error(sender, name, _ERRORS.get(cause, messages.MAV_PARAM_ERROR_PERMISSION_DENIED))
        # To Mission Planner any value means "successfully saved"; only for the radius its Write waits for one.
        if sender.station.behaviour.kind is not Kind.MISSION_PLANNER or name.upper() == WP_RADIUS:
            self._send(sender, name)

    def follow(self) -> None:
        """Send the values that have changed to all stations, which keep a copy, once any has read them.

        With more or fewer parameters, those that have got a list get it again.
        """
        table = self._settings.known.table
        if not self._told and table is self.followed:
            return
        self.followed = table
        before, values = self._told, self._values()
        if not before:
            return
        self._told = values
        if before.keys() == self._told.keys():
            for index, (name, value) in enumerate(self._told.items()):
                if before[name] != value:
                    self._ground.broadcast(_message(name, value, len(before), index))
            return
        for dialogue in self._dialogues.values():
            if 0 < dialogue.count != len(self._told) and dialogue.next is None:
                dialogue.next = 0
                self.due = -inf

    def tick(self, now: float) -> None:
        """Send the next parameters of each list."""
        lists = [(sender, dialogue) for sender, dialogue in self._dialogues.items() if dialogue.next is not None]
        self.due = now + _INTERVAL_S if lists else inf
        if not lists:
            return
        self._told = self._values()
        values = [*self._told.items()]
        each = max(_EACH // len(lists), 1)
        for sender, dialogue in lists[:_EACH]:
            assert dialogue.next is not None
            for index, (name, value) in enumerate(values[dialogue.next : dialogue.next + each], dialogue.next):
                sender.to(_message(name, value, len(values), index))
            dialogue.next += each
            if dialogue.next >= len(values):
                dialogue.next, dialogue.count = None, len(values)
            # The others' turn.
            self._dialogues[sender] = self._dialogues.pop(sender)

    def _dialogue(self, sender: Sender) -> _Dialogue:
        if sender not in self._dialogues:
            self._dialogues[sender] = _Dialogue()
        return self._dialogues[sender]

    def _name(self, table: SettingTable) -> None:
        """Give the board's settings their names."""
        numbers = {setting.name: setting for setting in table if setting.kind is not ValueKind.TEXT}
        if numbers.keys() != {*self._names.values()}:
            self._names = parameter_names(numbers, (*self._own.values(), WP_RADIUS))
        self._named = {parameter: numbers[name] for parameter, name in self._names.items()}
        radius = self._named.get(_RADIUS)
        alias = {} if radius is None or radius.fixed else {WP_RADIUS: radius}
        self._held = {parameter: float(setting.value) for parameter, setting in (alias | self._named).items()}

    def _values(self) -> dict[str, float]:
        """Every parameter, as the settings are known now. The bridge's own keep their indexes on every board."""
        table = self._settings.known.table
        if table is not None and table is not self._table:
            self._table = table
            self._name(table)
        return self._own.values() | self._held

    def _send(self, sender: Sender, name: str) -> None:
        """Send PARAM_VALUE under the name that the station uses, or PARAM_ERROR without such a parameter."""
        if name.upper() in self._values():
            sender.to(self._message(name))
        elif name:
            self._error(sender, name, messages.MAV_PARAM_ERROR_DOES_NOT_EXIST)

    def _error(self, sender: Sender, name: str, error: int) -> None:
        message = messages.MAVLink_param_error_message(sender.sysid, sender.compid, name.encode(), -1, error)
        self._ground.outbox.multicast(pack(message), [sender.station])

    def _message(self, name: str) -> Message:
        values, parameter = self._values(), name.upper()
        return _message(name, values[parameter], len(values), list(values).index(parameter))


def _message(name: str, value: float, count: int, index: int) -> Message:
    return messages.MAVLink_param_value_message(name.encode(), value, _REAL32, count, index)
