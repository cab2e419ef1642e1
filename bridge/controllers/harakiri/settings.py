# SPDX-License-Identifier: GPL-3.0-or-later
"""All settings of a Harakiri with the mission extension: the commands SETTING and SET_SETTING, and the modes of BOX."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import NamedTuple

from bridge.controllers.msp_parts import MspPartSettings
from bridge.fc.fc_settings import (
    ARMED,
    BUSY,
    NO_ANSWER,
    NOT_SAVED,
    NOT_TAKEN,
    WRITES_SPENT,
    FcSettings,
    SettingRefusal,
    TableReading,
    fixed,
)
from bridge.fc.profile import FlightController
from bridge.line.conversation import Conversation, Pause, ask, ask_surely
from bridge.model.settings import BoardSetting, SettingTable, Value, ValueKind, table_of
from protocols.msp import mission as ext
from protocols.msp.frame import FRAME_OVERHEAD
from protocols.msp.mission import InfoFlag, MissionCommand, ReplyStatus
from protocols.msp.setting_table import (
    TABLE_REQUEST,
    HeldSetting,
    Setting,
    SettingCommand,
    SettingsReply,
    SettingType,
    TableReply,
    decode_settings,
    decode_table,
    encode_read_settings,
    encode_save,
    encode_set_setting,
    table_checksum,
)
from protocols.msp.settings import BOXES

#: Settings per request, with names of 32 characters: the reply leaves room for a poll in the board's send ring.
_EACH = 4
_ENTRY_SIZE, _HEADER_SIZE, _TABLE_SIZE = 46, 3, 9
#: The table may change while it is read.
_READINGS = 3
#: For a configuration write that is scheduled.
_BUSY_TRIES, _BUSY_INTERVAL_S = 12, 0.1
#: Writing and reading back take a quarter of a second.
_SAVED_AFTER_S = 0.3
_SAVES = 2
_CRASHES = "changing it can crash a running Harakiri: set it on the board's command line"
_FIXED = dict.fromkeys(
    ("gbl_flg", *(f"align_{sensor}_{axis}" for sensor in ("gyro", "acc", "mag") for axis in "xyz")), _CRASHES
)
#: The units of the settings, as the firmware documents them. The others have none.
_UNITS = {
    name: unit
    for unit, names in {
        "us": (
            "rc_db rc_dbyw rc_dbah rc_dbgps rc_minchk rc_mid rc_maxchk esc_min esc_max esc_nfly esc_moff fs_rcthr "
            "tri_ymid tri_ymin tri_ymax looptime"
        ),
        "ms": "rc_killt tri_ydel al_tobaro al_tosnr gps_lag",
        "%": (
            "rc_rate rc_expo thr_mid thr_expo roll_pitch_rate yawrate rssicut al_debounce gps_expo "
            "gps_ph_minbrakepercent"
        ),
        "Hz": "esc_pwm srv_pwm acc_lpfhz acc_altlpfhz acc_gpslpfhz gy_lpf maincuthz gpscuthz",
        "0.1 s": "fs_delay fs_ofdel",
        "s": "fs_ddplt",
        "baud": "serial_baudrate gps_baudrate",
        "0.1 V": "vbatmaxcellvoltage vbatmincellvoltage",
        "cm/s": "al_barolr al_snrlr as_clmbr gps_ph_settlespeed rtl_cr nav_speed_min nav_speed_max",
        "m": "as_trgt gps_rtl_flyaway rtl_mnh rtl_mnd",
        "90 deg": "align_board_yaw",
        "min": "mag_time",
        "deg": "gps_maxangle gps_ph_brakemaxangle snr_tilt",
        "cm/s2": "gps_ph_brkacc",
        "cm": "gps_wp_radius snr_min snr_max",
    }.items()
    for name in names.split()
}  # fmt: skip
_LOWERED_ONLY = {"esc_moff": "it can only be lowered, because a disarmed board sends it to the motors"}


class _Place(NamedTuple):
    """A setting's handle: the place and description in the board's table."""

    number: int
    setting: Setting


class HarakiriFcSettings(FcSettings):
    """The settings of one patched Harakiri."""

    def __init__(self, board: FlightController) -> None:
        self._modes = MspPartSettings(board, BOXES)
        self._reply: SettingsReply | None = None

    def read(self, previous: SettingTable | None, reading: TableReading) -> Conversation[SettingTable | None]:
        """The values of the previous table if their checksum is still the board's: then that is three requests."""
        listed = None if previous is None else [each for each in previous if isinstance(each.handle, _Place)]
        for _ in range(_READINGS):
            whole = yield from _whole()
            if whole is None:
                return None
            if listed is not None and _is(listed, whole):
                modes = yield from self._modes.read(None, reading)
                return None if modes is None else table_of(*listed, *modes)
            listed = yield from _read(whole.total, reading)
            if listed is None:
                return None
        return None

    def write(self, setting: BoardSetting, value: Value) -> Conversation[SettingRefusal | None]:
        if not isinstance(setting.handle, _Place):
            return (yield from self._modes.write(setting, value))
        number, described = setting.handle
        frame = encode_set_setting(number, described, float(value))
        for _ in range(_BUSY_TRIES):
            self._reply = reply = yield from _ask(frame, SettingCommand.SET_SETTING, 1)
            if reply is None or reply.status is not ReplyStatus.BUSY:
                break
            yield Pause(_BUSY_INTERVAL_S)
        if reply is None:
            return NO_ANSWER
        if reply.status is ReplyStatus.RANGE and setting.raised:
            return fixed(replace(setting, fixed=setting.raised))
        if reply.status not in (ReplyStatus.OK, ReplyStatus.RANGE):
            return {ReplyStatus.ARMED: ARMED, ReplyStatus.BUSY: BUSY}.get(reply.status, NOT_TAKEN)
        return None

    def read_back(self, setting: BoardSetting) -> Conversation[Sequence[BoardSetting]]:
        """From the reply to the write, which the board has read from the RAM."""
        if not isinstance(setting.handle, _Place):
            return (yield from self._modes.read_back(setting))
        reply, (number, described) = self._reply, setting.handle
        if reply is None or (reply.first, [each.setting for each in reply.settings]) != (number, [described]):
            return ()
        return (_shown(number, reply.settings[0]),)

    def save(self) -> Conversation[SettingRefusal | None]:
        for _ in range(_SAVES):
            whole = yield from _whole()
            if whole is None:
                return NO_ANSWER
            frame = encode_save(whole.checksum)
            reply = yield from ask(frame, SettingCommand.SET_SETTING, _TABLE_SIZE, tries=1, exclusive=True)
            answer = None if reply is None else decode_settings(reply.payload[:_HEADER_SIZE])
            if answer is not None and answer.status is ReplyStatus.BUSY:
                info = yield from ask_surely(ext.INFO_REQUEST, MissionCommand.INFO, ext.INFO_SIZE)
                decoded = None if info is None else ext.decode_info(info.payload)
                return WRITES_SPENT if decoded is not None and InfoFlag.WRITES_SPENT in decoded.flags else BUSY
            if answer is not None and answer.status is ReplyStatus.ARMED:
                return ARMED
            yield Pause(_SAVED_AFTER_S)
            if answer is not None and answer.status is ReplyStatus.OK:
                after = yield from _whole()
                if after is None:
                    return NO_ANSWER
                return None if after.checksum == whole.checksum else NOT_SAVED
            # The reply is lost, or a value has changed meanwhile.
        return NO_ANSWER


def read_by_name(places: dict[str, int], *names: str) -> Conversation[list[float] | None]:
    """The values of these settings, or None if it lacks one, does not answer, or is armed.

    `places`: of the settings found so far, which this fills. New settings are at the table's end.
    """
    if not places:
        whole = yield from _whole()
        for first in range(whole.total - _EACH if whole else -_EACH, -_EACH, -_EACH):
            start = max(first, 0)
            reply = yield from _ask(encode_read_settings(start, _EACH), SettingCommand.SETTING, _EACH)
            if reply is None or reply.status is not ReplyStatus.OK:
                return None
            places |= {held.setting.name: place for place, held in enumerate(reply.settings, reply.first)}
            if places.keys() >= set(names):
                break
    values = []
    for name in names:
        if name not in places:
            return None
        reply = yield from _ask(encode_read_settings(places[name], 1), SettingCommand.SETTING, 1)
        if reply is None or not reply.settings or reply.settings[0].setting.name != name:
            return None
        values.append(reply.settings[0].value)
    return values


def _whole() -> Conversation[TableReply | None]:
    """Number and checksum of all settings, or None if it does not answer, or is armed."""
    reply = yield from ask(TABLE_REQUEST, SettingCommand.SETTING, _TABLE_SIZE)
    whole = None if reply is None else decode_table(reply.payload)
    return whole if whole is not None and whole.status is ReplyStatus.OK else None


def _ask(frame: bytes, command: int, count: int) -> Conversation[SettingsReply | None]:
    reply = yield from ask(frame, command, _HEADER_SIZE + count * _ENTRY_SIZE)
    return None if reply is None else decode_settings(reply.payload)


def _read(total: int, reading: TableReading) -> Conversation[list[BoardSetting] | None]:
    found: list[BoardSetting] = []
    damaged = 0
    while len(found) < total:
        frame = encode_read_settings(len(found), _EACH)
        reply = yield from _ask(frame, SettingCommand.SETTING, _EACH)
        if reply is None or reply.status is not ReplyStatus.OK or reply.first != len(found) or not reply.settings:
            # Damage that the XOR missed, or the board has armed.
            damaged += 1
            if reply is None or damaged > _READINGS:
                return None
            continue
        found += map(_shown, count(len(found)), reply.settings)
        yield Pause(reading.pace(len(frame) + FRAME_OVERHEAD + reply.size))
    return found


def _is(listed: Sequence[BoardSetting], whole: TableReply) -> bool:
    held = [HeldSetting(each.handle.setting, float(each.value)) for each in listed]
    return (len(held), table_checksum(held)) == (whole.total, whole.checksum)


def _shown(number: int, held: HeldSetting) -> BoardSetting:
    described, value = held
    kind = ValueKind.FLOAT if described.type is SettingType.FLOAT else ValueKind.INTEGER
    return BoardSetting(
        described.name,
        kind,
        described.minimum,
        described.maximum,
        value,
        _UNITS.get(described.name, ""),
        fixed=_FIXED.get(described.name, ""),
        raised=_LOWERED_ONLY.get(described.name, ""),
        handle=_Place(number, described),
    )
