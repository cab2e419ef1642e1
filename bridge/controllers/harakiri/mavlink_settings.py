# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a disarmed Harakiri that answers only MAVLink: read by PARAM_REQUEST_LIST, never changed.

It sends one every 100 ms or so, between its telemetry, and answers no PARAM_REQUEST_READ: to get the missing ones the
whole list is requested again. Until the list ends it does not go back to MSP.
"""

from collections.abc import Mapping, Sequence
from math import isfinite

from bridge.controllers.harakiri.setting_texts import TEXTS
from bridge.fc.fc_settings import Cause, FcSettings, SettingRefusal, TableReading, fixed
from bridge.line.conversation import Await, Conversation, Pause, Transmit
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, table_of
from protocols.mavlink.codec import decode, pack
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame

_REQUEST = pack(m.MAVLink_param_request_list_message(1, 200))
_VALUE = m.MAVLINK_MSG_ID_PARAM_VALUE
#: A board that has just disarmed answers the next probe for MSP, which must not be delayed.
_SETTLED_S = 1.2
#: The maximum number of requests for the list, in all and without any answer.
_LISTS, _SILENT_LISTS = 5, 2
#: Without a value for this long, the list has ended.
_SILENCE_S = 1.0
#: More than any build has: the number is the board's own.
_MOST = 1000
#: Values read without a pause; other requests then wait for a second or two.
_AT_ONCE = 10
_NAME_SIZE = 16
#: REAL32.
_LARGEST = 3.4e38
_FIXED = "read-only over its own MAVLink"
#: Settings with longer names, as the board lists them.
_LONG_NAMES = (
    "vbatmaxcellvoltage", "vbatmincellvoltage", "power_adc_channel", "pitch_direction_l", "pitch_direction_r",
    "gps_ph_settlespeed", "gps_ph_brakemaxangle", "gps_ph_minbrakepercent", "nav_controls_heading",
    "LED_ControlChannel", "LED_Toggle_Delay1", "LED_Toggle_Delay2", "LED_Toggle_Delay3",
)  # fmt: skip


class HarakiriMavlinkSettings(FcSettings):
    """They cannot be set.

    Harakiri's PARAM_SET also changes each setting whose name the given one begins with (rc_db with rc_dbyw), saves all
    of them half a second later, and crashes the board with another alignment of a sensor.
    """

    read_only = (
        "a change over its own MAVLink could crash the board. Disconnect other MAVLink devices from its port: over MSP"
        " it takes changes"
    )
    is_read_when_asked = True

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        yield Pause(_SETTLED_S)
        found: dict[int, tuple[str, float]] = {}
        count = _MOST
        for number in range(_LISTS):
            is_safe: bool = yield Transmit(_REQUEST)
            # Values of a list that a mission has interrupted, or of one that is being sent already.
            for _ in range(count if is_safe else 0):
                frame: MavlinkFrame | None = yield Await(frozenset((_VALUE,)), _SILENCE_S)
                if frame is None:
                    break
                value = decode(frame)
                if value is None or not value.param_index < value.param_count <= _MOST:
                    continue
                count = value.param_count
                found[value.param_index] = value.param_id, value.param_value
                if len(found) >= count:
                    break
                if len(found) % _AT_ONCE == 0:
                    yield Pause(0.0)
            if len(found) >= count or (not found and number + 1 == _SILENT_LISTS):
                break
        return _table(found, count) if found else None

    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        yield from ()
        return fixed(setting)

    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        yield from ()
        return ()

    def save(self) -> Conversation[SettingRefusal | None]:
        yield from ()
        return SettingRefusal(Cause.FIXED, f"Nothing is saved: {self.read_only}")


def _table(found: Mapping[int, tuple[str, float]], count: int) -> SettingTable:
    """The settings by their whole names. Of those that the board cuts to the same name none is shown if one lacks."""
    by_name: dict[str, list[float]] = {}
    for _, (name, value) in sorted(found.items()):
        by_name.setdefault(name, []).append(value)
    shown = []
    for name, values in by_name.items():
        whole = [long for long in _LONG_NAMES if long[:_NAME_SIZE] == name] or [name]
        if len(whole) == len(values) and all(map(isfinite, values)):
            shown += [_shown(each, value) for each, value in zip(whole, values, strict=True)]
    return table_of(*shown, is_complete=len(shown) == count)


def _shown(name: str, value: float) -> BoardSetting:
    """Its type and range are not listed."""
    unit, text = TEXTS.get(name, ("", ""))
    return BoardSetting(name, ValueKind.FLOAT, -_LARGEST, _LARGEST, value, unit, text=text, fixed=_FIXED)
