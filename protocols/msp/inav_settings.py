# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's settings by name or index, both directions (src/main/fc/fc_msp.c, src/main/fc/settings.h)."""

import struct
from enum import IntEnum
from typing import NamedTuple

from protocols.param_file import setting_name
from protocols.plain_text import plain_text

#: MSP command numbers.
COMMON_SETTING, COMMON_SET_SETTING, COMMON_SETTING_INFO = 0x1003, 0x1004, 0x1007

_DETAILS = struct.Struct("<HBBBiIHBB")
_INDEX = struct.Struct("<BH")
_LOOKUP = 1 << 6
#: Profiles of each kind: control, rates, batteries. Of mixers only two.
_PROFILES = 3


class InavType(IntEnum):
    """setting_type_e."""

    UINT8 = 0
    INT8 = 1
    UINT16 = 2
    INT16 = 3
    UINT32 = 4
    FLOAT = 5
    STRING = 6


#: By type, except texts.
_VALUES = [struct.Struct(f"<{letter}") for letter in "BbHhIf"]


class InavSetting(NamedTuple):
    """A reply to COMMON_SETTING_INFO. name: empty if settings cannot have it.

    section: 0 is for all profiles. place: in INAV's table. choices: names of the values from minimum on.
    """

    name: str
    group: int
    type: InavType
    section: int
    minimum: int
    maximum: int
    place: int
    choices: tuple[str, ...]
    value: float | str

    def encode(self) -> bytes:
        mode = _LOOKUP if self.choices else 0
        profiles = _PROFILES if self.section else 0
        details = _DETAILS.pack(
            self.group, self.type, self.section, mode, self.minimum, self.maximum, self.place, 0, profiles
        )
        texts = b"".join(_text(choice) for choice in self.choices)
        return _text(self.name) + details + texts + self.pack()

    def pack(self) -> bytes:
        """The value as INAV sends it: a text fills the place."""
        packed = pack_value(self.type, self.value)
        return packed.ljust(self.maximum, b"\0") if self.type is InavType.STRING else packed


def encode_about_index(index: int) -> bytes:
    """The payload that names a setting by the place in the table."""
    return _INDEX.pack(0, index)


def encode_about_name(name: str) -> bytes:
    """The payload that names a setting. A new value may follow."""
    return _text(name)


def pack_value(kind: InavType, value: float | str) -> bytes:
    """A value as COMMON_SET_SETTING takes it. Raises struct.error for one that the type cannot hold."""
    if isinstance(value, str):
        return value.encode("ascii", "replace")
    return _VALUES[kind].pack(value if kind is InavType.FLOAT else int(value))


def decode_setting_info(payload: bytes) -> InavSetting | None:
    """Read a reply to COMMON_SETTING_INFO. Returns None if it is truncated, or has an unknown type."""
    coded, rest = _take_text(payload)
    if not coded or rest is None or len(rest) < _DETAILS.size:
        return None
    group, kind, section, mode, minimum, maximum, index, _, _ = _DETAILS.unpack_from(rest)
    if kind > max(InavType):
        return None
    rest = rest[_DETAILS.size :]
    choices: list[str] = []
    count = maximum - minimum + 1 if mode == _LOOKUP else 0
    if not 0 <= count <= len(rest):
        return None
    for _ in range(count):
        choice, after = _take_text(rest)
        if after is None:
            return None
        choices.append(plain_text(choice))
        rest = after
    value = decode_value(InavType(kind), rest)
    if value is None:
        return None
    if kind in (InavType.INT8, InavType.INT16, InavType.FLOAT):
        # Sent as an unsigned number. The largest values of these types may be negative.
        maximum = struct.unpack("<i", struct.pack("<I", maximum))[0]
    name = setting_name(coded)
    return InavSetting(name, group, InavType(kind), section, minimum, maximum, index, tuple(choices), value)


def decode_value(kind: InavType, data: bytes) -> float | str | None:
    """The value in a reply, or None if it is truncated."""
    if kind is InavType.STRING:
        return plain_text(data.partition(b"\0")[0])
    if len(data) < _VALUES[kind].size:
        return None
    value: float = _VALUES[kind].unpack_from(data)[0]
    return value


def _text(text: str) -> bytes:
    return text.encode("ascii", "replace") + b"\0"


def _take_text(data: bytes) -> tuple[bytes, bytes | None]:
    """A text and the bytes after it, or None if the end is missing."""
    text, end, rest = data.partition(b"\0")
    return text, rest if end else None
