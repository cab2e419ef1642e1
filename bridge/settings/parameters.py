# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink parameters: the bridge's own, and every setting of the flight controller. Values are REAL32, as ArduPilot's.

https://mavlink.io/en/services/parameter.html

Ground stations keep the number of parameters that they heard first, so a list waits until the settings were read, and
is sent again to the stations that had got a shorter one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from weakref import WeakKeyDictionary

from bridge.fc.fc_settings import Cause, SettingRefusal
from bridge.gcs.cost import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.station import Severity, Station
from bridge.model.board_setting import BoardSetting, SettingTable, ValueKind, shown
from bridge.settings.board_settings import BoardSettings
from bridge.settings.own_parameters import OwnParameters
from bridge.settings.parameter_files import GENERAL_URI, ParameterFiles
from bridge.settings.parameter_names import parameter_names
from protocols.float32 import single
from protocols.mavlink.codec import pack, pack_component_metadata
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.ftp import FtpSession, file_crc32, is_opening

_REAL32 = 9
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


@dataclass(slots=True)
class _Dialogue:
    """The parameters sent to a station. next: the index in the list being sent, or None. count: of the last list."""

    station: Station
    session: FtpSession
    next: int | None = None
    count: int = 0
    awaits_list: bool = False


class Parameters:
    """Answers PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET, and requests for files."""

    def __init__(self, own: OwnParameters, settings: BoardSettings, ground: Ground) -> None:
        self._own = own
        self._settings = settings
        self._ground = ground
        #: The flight controller's settings by parameter.
        self._named: Mapping[str, BoardSetting] = {}
        #: The values that stations know, once one has read them.
        self._told: dict[str, float] = {}
        self._files = ParameterFiles()
        self._dialogues: WeakKeyDictionary[GroundStation, _Dialogue] = WeakKeyDictionary()
        settings.on_table = self._take
        #: The time of the next `tick`; infinity while no list is sent.
        self.due = inf

    def request_list(self, station: Station, now: float) -> None:
        """PARAM_REQUEST_LIST."""
        dialogue = self._dialogue(station)
        if dialogue is None or dialogue.awaits_list or not self._ground.allows(station, Cost.LIST):
            return
        dialogue.awaits_list, dialogue.station = True, station

        def done(table: SettingTable | SettingRefusal, at: float) -> None:
            if isinstance(table, SettingRefusal) and table.cause is Cause.NO_ANSWER:
                self._ground.say(Severity.WARNING, table.text, station)
            dialogue.awaits_list, dialogue.next = False, 0
            self.due = min(self.due, at)

        self._settings.current(done, now, _LIST_WITHIN_S)

    def send_one(self, station: Station, name: str, index: int, now: float) -> None:
        """PARAM_REQUEST_READ: by index, or by name where index is -1."""
        names = list(self._values())
        if index >= 0:
            self.send(station, names[index] if index < len(names) else "")
            return

        def done(table: SettingTable | SettingRefusal, _at: float) -> None:
            if not isinstance(table, SettingRefusal) or table.cause is not Cause.OCCUPIED:
                self.send(station, name)

        if name in names or self._settings.table is not None:
            self.send(station, name)
        else:
            self._settings.current(done, now, _LIST_WITHIN_S)

    def set(self, station: Station, name: str, value: float, now: float) -> None:
        """PARAM_SET: answered with the value that is then in force, as the protocol requires."""
        setting = self._named.get(name)
        if setting is None:
            self._own.set(station, name, value, now, lambda to: self.send(to, name))
        elif value == single(float(setting.value)):
            self.send(station, name)
        elif setting.kind is ValueKind.INTEGER and isfinite(value) and abs(value) >= _MOST_EXACT:
            above = f"{name} stays {shown(setting.value)}: only up to {_MOST_EXACT - 1} over MAVLink"
            self._refuse(station, name, SettingRefusal(Cause.OUT_OF_RANGE, above))
        else:
            self._settings.change(
                setting.name, value, lambda result, _at: self._changed(station, name, result), now, str(station)
            )

    def answer_file(self, station: Station, payload: Sequence[int], now: float) -> None:
        """FILE_TRANSFER_PROTOCOL."""
        dialogue = self._dialogue(station)
        if dialogue is None:
            return
        self._files.show(self._values(), self._named)
        if is_opening(payload):
            # Changes that were not made through the bridge follow as PARAM_VALUE.
            self._settings.current(lambda _table, _at: None, now, _LIST_WITHIN_S)
        for number, answer in enumerate(dialogue.session.answer(payload)):
            if number and not self._ground.allows(station, Cost.ANSWER):
                return
            self._ground.to(
                station, messages.MAVLink_file_transfer_protocol_message(0, station.sysid, station.compid, answer)
            )

    def metadata(self, uptime_ms: int) -> Message | None:
        """COMPONENT_METADATA, which names the file with the descriptions; None before the settings are known."""
        if not self._named:
            return None
        self._files.show(self._values(), self._named)
        crc = file_crc32(self._files.general())
        return pack_component_metadata(uptime_ms, crc, GENERAL_URI)

    def follow(self) -> None:
        """Send the values that have changed to all stations, which keep a copy, once any has read them."""
        if not self._told:
            return
        before, self._told = self._told, self._values()
        if len(before) == len(self._told):
            for name, value in self._told.items():
                if before.get(name) != value:
                    self._ground.broadcast(self._message(self._told, name))

    def tick(self, now: float) -> None:
        """Send the next parameters of each list."""
        lists = [(peer, dialogue) for peer, dialogue in self._dialogues.items() if dialogue.next is not None]
        self.due = now + _INTERVAL_S if lists else inf
        if not lists:
            return
        self._told = values = self._values()
        names = [*values]
        each = max(_EACH // len(lists), 1)
        for ground_station, dialogue in lists[:_EACH]:
            assert dialogue.next is not None
            for index in range(dialogue.next, min(dialogue.next + each, len(names))):
                self._ground.to(dialogue.station, self._value_at(values, names[index], index))
            dialogue.next += each
            if dialogue.next >= len(names):
                dialogue.next, dialogue.count = None, len(names)
            # The others' turn.
            self._dialogues[ground_station] = self._dialogues.pop(ground_station)

    def _dialogue(self, station: Station) -> _Dialogue | None:
        ground_station = self._ground.station(station.peer)
        if ground_station is None:
            return None
        if ground_station not in self._dialogues:
            self._dialogues[ground_station] = _Dialogue(station, FtpSession(self._files.find))
        return self._dialogues[ground_station]

    def _take(self, table: SettingTable, now: float) -> None:
        """The settings were read, or one of them has changed."""
        reserved = self._own.values()
        numbers = {setting.name: setting for setting in table if setting.kind is not ValueKind.TEXT}
        self._named = {name: numbers[long] for name, long in parameter_names(numbers, reserved).items()}
        self.follow()
        count = len(self._values())
        for dialogue in self._dialogues.values():
            if 0 < dialogue.count != count and dialogue.next is None:
                dialogue.next = 0
                self.due = min(self.due, now)

    def _changed(self, station: Station, name: str, result: BoardSetting | SettingRefusal) -> None:
        if isinstance(result, SettingRefusal):
            self._refuse(station, name, result)
        else:
            self.send(station, name)

    def _refuse(self, station: Station, name: str, refused: SettingRefusal) -> None:
        """Send the reason, then the value in force. PARAM_ERROR, which MAVLink 1 lacks, spares MAVSDK a wait."""
        self._ground.say(Severity.ERROR, refused.text, station)
        self._error(station, name, _ERRORS.get(refused.cause, messages.MAV_PARAM_ERROR_PERMISSION_DENIED))
        self.send(station, name)

    def _values(self) -> dict[str, float]:
        """Every parameter. The bridge's own keep their indexes on every board."""
        values = self._own.values()
        for name, setting in self._named.items():
            values[name] = float(setting.value)
        return values

    def send(self, station: Station | None, name: str) -> None:
        """Send PARAM_VALUE, or PARAM_ERROR without such a parameter; None: to all stations, which keep a copy."""
        values = self._values()
        if name not in values:
            if station is not None and name:
                self._error(station, name, messages.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        elif station is None:
            self._ground.broadcast(self._message(values, name))
            self._told |= {name: values[name]} if self._told else {}
        else:
            self._ground.to(station, self._message(values, name))

    def _error(self, station: Station, name: str, error: int) -> None:
        message = messages.MAVLink_param_error_message(station.sysid, station.compid, name.encode(), -1, error)
        if (receiver := self._ground.station(station.peer)) is not None:
            self._ground.multicast(pack(message), [receiver])

    def _message(self, values: Mapping[str, float], name: str) -> Message:
        return self._value_at(values, name, list(values).index(name))

    @staticmethod
    def _value_at(values: Mapping[str, float], name: str, index: int) -> Message:
        return messages.MAVLink_param_value_message(name.encode(), values[name], _REAL32, len(values), index)
