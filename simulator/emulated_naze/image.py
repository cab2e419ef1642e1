# SPDX-License-Identifier: GPL-3.0-or-later
"""A firmware image from an ELF file: its bytes for the flash, and its symbols."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

#: The address and size of an STM32F103CB's flash.
FLASH_BASE = 0x0800_0000
FLASH_SIZE = 0x2_0000
_MAGIC = b"\x7fELF\x01\x01"
_ARM = 40
_LOAD, _SYMBOLS = 1, 2
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


def load_image(path: Path) -> Image:
    """Read an ELF file. ImageError, OSError."""
    data = path.read_bytes()
    try:
        return Image(*_parse(data))
    except (struct.error, IndexError, ValueError) as error:
        raise ImageError(
            f"{path} is not an ELF file of a 32-bit ARM program for flash at {FLASH_BASE:#010x}"
        ) from error


def _parse(data: bytes) -> tuple[bytes, dict[str, int]]:
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
                found[data[start : data.index(b"\0", start)].decode(errors="replace")] = value
    return found
