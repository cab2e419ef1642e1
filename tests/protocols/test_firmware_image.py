# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware images as Intel HEX and binary files."""

import struct
from pathlib import Path

import pytest

from protocols.firmware_image import FLASH_BASE, PATCH_MARK, ImageError, check_patched, parse_image

PROGRAM = struct.pack("<II", 0x2000_5000, FLASH_BASE + 0x101) + bytes(range(256)) * 2


def hex_file(program: bytes, base: int = FLASH_BASE) -> str:
    def record(address: int, kind: int, payload: bytes) -> str:
        body = struct.pack(">BHB", len(payload), address, kind) + payload
        return f":{(body + bytes((-sum(body) & 0xFF,))).hex().upper()}\n"

    lines = record(0, 4, struct.pack(">H", base >> 16))
    for at in range(0, len(program), 16):
        lines += record(at, 0, program[at : at + 16])
    return lines + record(0, 5, struct.pack(">I", base + 0x101)) + record(0, 1, b"")


def test_hex_and_binary_files_have_the_same_program() -> None:
    assert parse_image(hex_file(PROGRAM).encode(), "x.HEX") == parse_image(PROGRAM, "x.BIN") == PROGRAM


@pytest.mark.parametrize(
    ("name", "contents"),
    [
        ("x.hex", hex_file(PROGRAM, 0x2000_0000).encode()),
        ("x.hex", hex_file(PROGRAM).replace(":10", ":11", 1).encode()),
        ("x.hex", hex_file(PROGRAM)[:-20].replace("\n:", "\n;").encode()),
        ("x.hex", b"\xff\xfe"),
        ("x.hex", b""),
        ("x.bin", b""),
        ("x.bin", b"\xff" * 1000),
        ("x.bin", PROGRAM + bytes(0x2_0000)),
    ],
)
def test_anything_else_is_refused_with_one_line(name: str, contents: bytes) -> None:
    with pytest.raises(ImageError) as refused:
        parse_image(contents, name)
    assert name in str(refused.value)
    assert "\n" not in str(refused.value)


HARAKIRI = PROGRAM + b"That was Harakiri"
PATCHED = HARAKIRI + PATCH_MARK


@pytest.mark.parametrize(
    ("program", "why"),
    [
        (b"\xff" * 2000, "does not begin with the vectors"),
        (struct.pack("<II", 0x2000_5000, FLASH_BASE + 0x100) + PATCHED[8:], "does not begin with the vectors"),
        (struct.pack("<II", 0x1000_5000, FLASH_BASE + 0x101) + PATCHED[8:], "does not begin with the vectors"),
        (struct.pack("<II", 0x2000_5000, FLASH_BASE + 0x1_0001) + PATCHED[8:], "does not begin with the vectors"),
        (PROGRAM + PATCH_MARK, "not a Harakiri"),
        (HARAKIRI, "without the mission patch"),
        (PATCHED.ljust(0x1_D800 + 1, b"\0"), "too large"),
    ],
)
def test_only_a_patched_harakiri_may_be_flashed(program: bytes, why: str) -> None:
    with pytest.raises(ImageError, match=why):
        check_patched(program)
    check_patched(PATCHED.ljust(0x1_D800, b"\0"))


def test_the_patch_is_recognised_by_its_own_table_and_ends_where_the_sources_say() -> None:
    firmware = Path(__file__).parents[2] / "firmware"
    words = ", ".join(f"0x{word:08X}u" for word in struct.unpack("<4I", PATCH_MARK))
    assert words in (firmware / "naze_slots.c").read_text()
    assert "LINKED_BELOW 0x0801D800u" in (firmware / "harakiri_flash.c").read_text()
