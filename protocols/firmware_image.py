# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware images for a Naze32, as ELF, Intel HEX and binary files; how a Harakiri with our patch is recognised.

An image is the flash's contents from its first byte; an ELF file also has symbols.
"""

import struct
from binascii import unhexlify
from dataclasses import dataclass, field

from protocols.plain_text import plain_text

#: The address and size of an STM32F103CB's flash.
FLASH_BASE = 0x0800_0000
FLASH_SIZE = 0x2_0000
#: A patched Harakiri keeps its missions and its configuration from this offset (firmware/README.md, Flash map).
PROGRAM_END = 0x1_D800
_MAGIC = b"\x7fELF\x01\x01"
_ARM = 40
_LOAD, _SYMBOLS = 1, 2
_RAM, _RAM_SIZE = 0x2000_0000, 0x5000
_HARAKIRI = b"Harakiri"
#: The patch's table for checksums (naze_slots.c): Harakiri itself computes no CRC-32.
PATCH_MARK = struct.pack("<4I", 0x0000_0000, 0x1DB7_1064, 0x3B6E_20C8, 0x26D9_30AC)
# Types of records; those that set a base have it shifted by this many bits.
_HEX_DATA, _HEX_BASES = 0, {2: 4, 4: 16}
_HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
_PROGRAM_HEADER = struct.Struct("<8I")
_SECTION_HEADER = struct.Struct("<10I")
_SYMBOL = struct.Struct("<IIIBBH")


class ImageError(Exception):
    """The file has no image for this board; one sentence."""


@dataclass(frozen=True, slots=True)
class Image:
    """`program` begins at the flash's first byte; `symbols` are the addresses by name."""

    program: bytes
    symbols: dict[str, int] = field(default_factory=dict)


def parse_image(data: bytes, name: str) -> Image:
    """Parse a file by its name: .hex and .bin, anything else is an ELF file. ImageError."""
    readers = {".hex": ("an Intel HEX file", _parse_hex), ".bin": ("a binary", _parse_binary)}
    kind, parse = readers.get(name[-4:].lower(), ("an ELF file", _parse_elf))
    try:
        return Image(*parse(data))
    except (struct.error, IndexError, ValueError) as error:
        raise ImageError(f"{name} is not {kind} of a 32-bit ARM program for flash at {FLASH_BASE:#010x}") from error


def is_patched(program: bytes) -> bool:
    """True if it is a Harakiri with the mission patch."""
    return _HARAKIRI in program and PATCH_MARK in program


def check_backup(contents: bytes) -> None:
    """ImageError if this is not the whole flash of a Naze32 with a Harakiri."""
    check_harakiri(contents)
    if len(contents) != FLASH_SIZE:
        raise ImageError(f"a backup has {FLASH_SIZE} bytes, not {len(contents)}")


def check_patched(program: bytes) -> None:
    """ImageError if a Naze32 cannot run this as a Harakiri with the mission patch."""
    check_harakiri(program)
    if PATCH_MARK not in program:
        raise ImageError("the image is a Harakiri without the mission patch: run firmware/apply on its sources first")
    if len(program) > PROGRAM_END:
        raise ImageError(f"the image is too large: {len(program)} bytes, {PROGRAM_END} fit below missions and settings")


def check_harakiri(program: bytes) -> None:
    """ImageError if a Naze32 cannot run this as a Harakiri."""
    try:
        _parse_binary(program)
    except (struct.error, ValueError):
        raise ImageError("the image does not begin with the vectors of a program for a Naze32") from None
    if _HARAKIRI not in program:
        raise ImageError("the image is not a Harakiri")


def _parse_binary(data: bytes) -> tuple[bytes, dict[str, int]]:
    """The flash from its first byte; it begins with the stack pointer and the entry, in Thumb code."""
    stack, entry = struct.unpack_from("<II", data)
    if not 0 < stack - _RAM <= _RAM_SIZE or not entry & 1 or not 0 <= entry - FLASH_BASE < len(data) <= FLASH_SIZE:
        raise ValueError
    return data, {}


def _parse_hex(data: bytes) -> tuple[bytes, dict[str, int]]:
    """Intel's Hexadecimal Object File Format Specification, revision A (1988)."""
    program, base = bytearray(), 0
    for line in data.split():
        if not line.startswith(b":"):
            raise ValueError
        record = unhexlify(line[1:])
        count, address, kind = struct.unpack_from(">BHB", record)
        payload = record[4:-1]
        if sum(record) & 0xFF or len(payload) != count:
            raise ValueError
        if kind == _HEX_DATA:
            start = base + address - FLASH_BASE
            if start < 0 or start + count > FLASH_SIZE:
                raise ValueError
            program.extend(b"\xff" * (start + count - len(program)))
            program[start : start + count] = payload
        elif kind in _HEX_BASES:
            base = int.from_bytes(payload) << _HEX_BASES[kind]
    return _parse_binary(bytes(program))


def _parse_elf(data: bytes) -> tuple[bytes, dict[str, int]]:
    if not data.startswith(_MAGIC):
        raise ValueError
    _, _, machine, _, _, programs, sections, _, _, _, program_count, _, section_count, _ = _HEADER.unpack_from(data)
    if machine != _ARM:
        raise ValueError
    return _program(data, programs, program_count), _symbols(data, sections, section_count)


def _program(data: bytes, at: int, count: int) -> bytes:
    program = bytearray()
    for index in range(count):
        kind, offset, _, address, size, *_ = _PROGRAM_HEADER.unpack_from(data, at + index * _PROGRAM_HEADER.size)
        if kind == _LOAD and size:
            start = address - FLASH_BASE
            if start < 0 or start + size > FLASH_SIZE:
                raise ValueError
            program.extend(b"\xff" * (start + size - len(program)))
            program[start : start + size] = data[offset : offset + size]
    if not program:
        raise ValueError
    return bytes(program)


def _symbols(data: bytes, at: int, count: int) -> dict[str, int]:
    headers = [_SECTION_HEADER.unpack_from(data, at + index * _SECTION_HEADER.size) for index in range(count)]
    found: dict[str, int] = {}
    for _, kind, _, _, offset, size, link, *_ in headers:
        if kind == _SYMBOLS:
            names = headers[link][4]
            for name, value, _, _, _, _ in _SYMBOL.iter_unpack(data[offset : offset + size]):
                start = names + name
                found[plain_text(data[start : data.index(b"\0", start)])] = value
    return found
