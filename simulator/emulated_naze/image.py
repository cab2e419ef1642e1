# SPDX-License-Identifier: GPL-3.0-or-later
"""A firmware image from an ELF, Intel HEX or binary file: its bytes for the flash, and from an ELF its symbols."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

#: The address and size of an STM32F103CB's flash.
FLASH_BASE = 0x0800_0000
FLASH_SIZE = 0x2_0000
_MAGIC = b"\x7fELF\x01\x01"
_ARM = 40
_LOAD, _SYMBOLS = 1, 2
_RAM = 0x2000_0000
# Types of records; those that set a base have it shifted by so many bits.
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


def load_image(path: Path) -> Image:
    """Read a file by its name: .hex and .bin, anything else is an ELF file. ImageError, OSError."""
    data = path.read_bytes()
    readers = {".hex": ("an Intel HEX file", _parse_hex), ".bin": ("a binary", _parse_binary)}
    kind, parse = readers.get(path.suffix.lower(), ("an ELF file", _parse))
    try:
        return Image(*parse(data))
    except (struct.error, IndexError, ValueError) as error:
        raise ImageError(f"{path} is not {kind} of a 32-bit ARM program for flash at {FLASH_BASE:#010x}") from error


def _parse_binary(data: bytes) -> tuple[bytes, dict[str, int]]:
    """The flash from its first byte; it begins with the stack pointer and the entry."""
    stack, entry = struct.unpack_from("<II", data)
    if len(data) > FLASH_SIZE or stack >> 20 != _RAM >> 20 or not 0 <= entry - FLASH_BASE < len(data):
        raise ValueError
    return data, {}


def _parse_hex(data: bytes) -> tuple[bytes, dict[str, int]]:
    """Intel's Hexadecimal Object File Format Specification, revision A (1988)."""
    program, base = bytearray(), 0
    for line in data.decode("ascii").split():
        if line[0] != ":":
            raise ValueError
        record = bytes.fromhex(line[1:])
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
