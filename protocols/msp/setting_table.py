# SPDX-License-Identifier: GPL-3.0-or-later
"""All settings of a patched Harakiri: the commands SETTING and SET_SETTING (docs/msp-mission.md)."""

import struct
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import NamedTuple
from zlib import crc32

from protocols.msp.frame import masked_request
from protocols.msp.mission import ReplyStatus

#: The index that means all settings: their checksum, or a save.
WHOLE_TABLE = 0xFFFF
_VALUES = ("<B", "<b", "<H", "<h", "<I", "<f")
_DESCRIPTION = struct.Struct("<BiiB")
_HEADER = struct.Struct("<BH")
_READ = struct.Struct("<HH")
_SET = struct.Struct("<HI4s")
_TABLE = struct.Struct("<BHHI")


class SettingCommand(IntEnum):
    """MSP command numbers."""

    SETTING = 197
    SET_SETTING = 198


class SettingType(IntEnum):
    """vartype_e in cli.c."""

    UINT8 = 0
    INT8 = 1
    UINT16 = 2
    INT16 = 3
    UINT32 = 4
    FLOAT = 5


class Setting(NamedTuple):
    """A setting as the board describes it. The limits are whole numbers for every type."""

    name: str
    type: SettingType
    minimum: int
    maximum: int

    @property
    def description(self) -> bytes:
        name = self.name.encode("latin-1")
        return _DESCRIPTION.pack(self.type, self.minimum, self.maximum, len(name)) + name

    @property
    def identity(self) -> int:
        """The hash that a request to set it must have, so that it does not reach another build's setting."""
        return crc32(self.description)

    def pack(self, value: float) -> bytes:
        """The four bytes on the wire. Raises struct.error for a value that the type cannot hold."""
        if self.type is SettingType.FLOAT:
            return struct.pack("<f", value)
        return struct.pack("<i" if self.type in (SettingType.INT8, SettingType.INT16) else "<I", int(value))

    def unpack(self, data: bytes) -> float:
        """The value in the first of four bytes, as the board's variable keeps it."""
        value: float = struct.unpack_from(_VALUES[self.type], data)[0]
        return value


class HeldSetting(NamedTuple):
    """A setting with the value that the board holds in RAM."""

    setting: Setting
    value: float

    def encode(self) -> bytes:
        return self.setting.pack(self.value) + self.setting.description


class SettingsReply(NamedTuple):
    """Reply to SETTING: as many settings from `first` on as fit. To SET_SETTING: that setting, even if out of range."""

    status: ReplyStatus
    first: int
    settings: Sequence[HeldSetting] = ()

    @property
    def size(self) -> int:
        """The size of the payload, bytes."""
        return _HEADER.size + sum(len(held.encode()) for held in self.settings)


class TableReply(NamedTuple):
    """Reply about all settings: their number and `table_checksum`."""

    status: ReplyStatus
    total: int
    checksum: int


def table_checksum(settings: Iterable[HeldSetting]) -> int:
    """CRC-32 over all settings in the board's order, values included."""
    return crc32(b"".join(held.encode() for held in settings))


def encode_read_settings(first: int, count: int) -> bytes:
    return masked_request(SettingCommand.SETTING, _READ.pack(first, count))


TABLE_REQUEST = encode_read_settings(WHOLE_TABLE, 1)


def encode_set_setting(index: int, setting: Setting, value: float) -> bytes:
    """Encode a change in RAM. struct.error for a value that the setting's type cannot hold."""
    return masked_request(SettingCommand.SET_SETTING, _SET.pack(index, setting.identity, setting.pack(value)))


def encode_save(checksum: int) -> bytes:
    """Encode a save of the settings with this `table_checksum`. The board does not save others."""
    return masked_request(SettingCommand.SET_SETTING, _SET.pack(WHOLE_TABLE, 0, checksum.to_bytes(4, "little")))


def decode_settings(payload: bytes) -> SettingsReply | None:
    """Read a reply with settings. Returns None if it is truncated, or has an unknown status or type."""
    if len(payload) < _HEADER.size or payload[0] > max(ReplyStatus):
        return None
    status, first = _HEADER.unpack_from(payload)
    found, at = [], _HEADER.size
    while at < len(payload):
        held = _decode_entry(payload[at:])
        if held is None:
            return None
        found.append(held)
        at += len(held.encode())
    return SettingsReply(ReplyStatus(status), first, found)


def decode_table(payload: bytes) -> TableReply | None:
    """Read a reply about all settings. Returns None if it is another."""
    if len(payload) < _TABLE.size or payload[0] > max(ReplyStatus):
        return None
    status, index, total, checksum = _TABLE.unpack_from(payload)
    return TableReply(ReplyStatus(status), total, checksum) if index == WHOLE_TABLE else None


def _decode_entry(data: bytes) -> HeldSetting | None:
    name_at = 4 + _DESCRIPTION.size
    if len(data) < name_at:
        return None
    kind, minimum, maximum, length = _DESCRIPTION.unpack_from(data, 4)
    if kind > max(SettingType) or not 0 < length <= len(data) - name_at:
        return None
    name = data[name_at : name_at + length].decode("latin-1")
    setting = Setting(name, SettingType(kind), minimum, maximum)
    return HeldSetting(setting, setting.unpack(data))
