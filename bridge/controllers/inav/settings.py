# SPDX-License-Identifier: GPL-3.0-or-later
"""All settings of an INAV, one request each, by their place in its table, and its modes."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from bridge.controllers.msp_parts import MspPartSettings
from bridge.fc.fc_settings import (
    NO_ANSWER,
    NOT_TAKEN,
    FcSettings,
    SettingRefusal,
    TableReading,
    fixed,
)
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Pause, ask
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, table_of
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, frame_size, request
from protocols.msp.inav_settings import (
    COMMON_SET_SETTING,
    COMMON_SETTING_INFO,
    InavSetting,
    InavType,
    decode_setting_info,
    encode_about_index,
    encode_about_name,
    pack_value,
)
from protocols.msp.settings import RANGES

#: The usual size. Its ring also holds the few replies with many names of values.
_REPLY_SIZE = 160
#: INAV has about 650. A board that never ends the table must not be asked for ever.
_MOST = 2000
_TRIES = 3
#: PIDs, modes, rates and MISC. With EZ Tune on (the first byte), each reading of the PIDs lets INAV compute them again.
_SOME = (Msp.INAV_EZ_TUNE, Msp.PID_V2, Msp.MODE_RANGES, Msp.INAV_RATE_PROFILE, Msp.INAV_MISC)
_KINDS = {InavType.FLOAT: ValueKind.FLOAT, InavType.STRING: ValueKind.TEXT}
#: Disarmed motors get these pulses.
_LOWERED_ONLY = {"min_command": "it can only be lowered, because disarmed motors get this pulse"}
_FIXED = {"3d_neutral": "disarmed motors get this pulse: set it with INAV Configurator"}


class InavFcSettings(FcSettings):
    """The settings of one INAV. A setting's handle is the type there. Those of profiles are the active one's."""

    def __init__(self, board: FlightController) -> None:
        self._modes = MspPartSettings(board, RANGES)
        #: The replies to `_SOME` when the whole table was read, or None after a change through the bridge.
        self._some: list[bytes] | None = None

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        """INAV lacks a checksum: while none changes of some settings, the others are taken to be the same."""
        some = yield from self._ask_some()
        if some is None:
            return None
        if previous is not None and not reading.is_doubtful and self._some in (None, some):
            self._some = some
            return previous
        found: list[BoardSetting] = []
        skipped = 0
        for index in range(_MOST):
            payload = encode_about_index(index)
            is_past_end = False
            for _ in range(_TRIES):
                reply = yield from _ask(payload)
                if reply is None:
                    return None
                is_past_end = reply.direction is Direction.ERROR
                yield Pause(reading.pace(frame_size(COMMON_SETTING_INFO, len(payload)) + len(reply.encode())))
                info = None if is_past_end else decode_setting_info(reply.payload)
                if info is not None and info.place == index:
                    found.append(_shown(info))
                    break
            else:
                if is_past_end:  # one error frame alone may be noise
                    break
                skipped += 1
        modes = yield from self._modes.read(None, reading)
        self._some = some
        return table_of(*found, *modes or (), is_complete=modes is not None and not skipped) if found else None

    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        self._some = None
        if not isinstance(setting.handle, InavType):
            return (yield from self._modes.write(setting, value))
        if setting.raised and float(value) > float(setting.value):
            return fixed(replace(setting, fixed=setting.raised))
        payload = encode_about_name(setting.name) + pack_value(setting.handle, value)
        reply = yield from ask(request(COMMON_SET_SETTING, payload), COMMON_SET_SETTING, 0)
        if reply is None:
            return NO_ANSWER
        return NOT_TAKEN if reply.direction is Direction.ERROR else None

    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        if not isinstance(setting.handle, InavType):
            return (yield from self._modes.read_back(setting))
        reply = yield from _ask(encode_about_name(setting.name))
        info = None if reply is None else decode_setting_info(reply.payload)
        return () if info is None or info.name != setting.name else (_shown(info),)

    def _ask_some(self) -> Conversation[list[bytes] | None]:
        found: list[bytes] = []
        for command in _SOME:
            if command == Msp.PID_V2 and any(found[0][:1]):
                continue
            payload = yield from self._modes.payload(command)
            if payload is None:
                return None
            found.append(payload)
        return found


def read_values(names: Iterable[str]) -> Conversation[dict[str, Value] | None]:
    """The values of these settings. Those that this version lacks are missing. None if it does not answer."""
    values: dict[str, Value] = {}
    for name in names:
        reply = yield from _ask(encode_about_name(name))
        if reply is None:
            return None
        info = None if reply.direction is Direction.ERROR else decode_setting_info(reply.payload)
        if info is not None and info.name == name:
            values[name] = info.value
    return values


def _ask(payload: bytes) -> Conversation[MspFrame | None]:
    return (yield from ask(request(COMMON_SETTING_INFO, payload), COMMON_SETTING_INFO, _REPLY_SIZE))


def _shown(info: InavSetting) -> BoardSetting:
    kind = _KINDS.get(info.type, ValueKind.INTEGER)
    return BoardSetting(
        info.name,
        kind,
        info.minimum,
        info.maximum,
        info.value,
        choices=info.choices,
        fixed=_FIXED.get(info.name, ""),
        raised=_LOWERED_ONLY.get(info.name, ""),
        handle=info.type,
    )
