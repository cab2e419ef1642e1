# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware images for a Naze32, as Intel HEX and binary files. How a Harakiri with our patch is recognised."""

import struct
from binascii import unhexlify

#: The address and size of an STM32F103CB's flash.
FLASH_BASE = 0x0800_0000
FLASH_SIZE = 0x2_0000
#: A patched Harakiri keeps the missions and the configuration from this offset (firmware/README.md, Flash map).
PROGRAM_END = 0x1_D800
_RAM, _RAM_SIZE = 0x2000_0000, 0x5000
_HARAKIRI = b"Harakiri"
#: The patch's table for checksums (naze_slots.c): Harakiri itself does not compute a CRC-32.
PATCH_MARK = struct.pack("<4I", 0x0000_0000, 0x1DB7_1064, 0x3B6E_20C8, 0x26D9_30AC)
# Types of records. Those that set a base have it shifted by this many bits.
_HEX_DATA, _HEX_BASES = 0, {2: 4, 4: 16}


class ImageError(Exception):
    """The file does not hold an image for this board, in a sentence."""


def parse_image(data: bytes, name: str) -> bytes:
    """The flash from the first byte on: Intel HEX if the file's name ends in .hex, else a binary. ImageError."""
    is_hex = name.lower().endswith(".hex")
    try:
        return _parse_hex(data) if is_hex else _parse_binary(data)
    except (struct.error, IndexError, ValueError) as error:
        kind = "an Intel HEX file" if is_hex else "a binary"
        raise ImageError(f"{name} is not {kind} of a 32-bit ARM program for flash at {FLASH_BASE:#010x}") from error


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


def _parse_binary(data: bytes) -> bytes:
    """The flash from the first byte. It begins with the stack pointer and the entry, in Thumb code."""
    stack, entry = struct.unpack_from("<II", data)
    if not 0 < stack - _RAM <= _RAM_SIZE or not entry & 1 or not 0 <= entry - FLASH_BASE < len(data) <= FLASH_SIZE:
        raise ValueError
    return data


def _parse_hex(data: bytes) -> bytes:
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
