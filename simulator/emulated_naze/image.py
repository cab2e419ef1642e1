# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that the emulated chip runs: those of protocols.firmware_image, and ELF files, which have symbols."""

import struct
from dataclasses import dataclass, field

from protocols.firmware_image import FLASH_BASE, FLASH_SIZE, ImageError, parse_image
from protocols.plain_text import plain_text

_MAGIC = b"\x7fELF\x01\x01"
_ARM = 40
_LOAD, _SYMBOLS = 1, 2
_HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
_PROGRAM_HEADER = struct.Struct("<8I")
_SECTION_HEADER = struct.Struct("<10I")
_SYMBOL = struct.Struct("<IIIBBH")


@dataclass(frozen=True, slots=True)
class Image:
    """`program` begins at the flash's first byte. `symbols` are the addresses by name."""

    program: bytes
    symbols: dict[str, int] = field(default_factory=dict)


def load_image(data: bytes, name: str) -> Image:
    """Parse a file by name: .hex and .bin, anything else is an ELF file. ImageError."""
    if name.lower().endswith((".hex", ".bin")):
        return Image(parse_image(data, name))
    try:
        return _parse_elf(data)
    except (struct.error, IndexError, ValueError) as error:
        raise ImageError(
            f"{name} is not an ELF file of a 32-bit ARM program for flash at {FLASH_BASE:#010x}"
        ) from error


def _parse_elf(data: bytes) -> Image:
    if not data.startswith(_MAGIC):
        raise ValueError
    _, _, machine, _, _, programs, sections, _, _, _, program_count, _, section_count, _ = _HEADER.unpack_from(data)
    if machine != _ARM:
        raise ValueError
    return Image(_program(data, programs, program_count), _symbols(data, sections, section_count))


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
