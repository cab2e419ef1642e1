# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware images as ELF, Intel HEX and binary files."""

import struct
from pathlib import Path

import pytest

from simulator.emulated_naze.image import FLASH_BASE, FLASH_SIZE, ImageError, load_image

PROGRAM = struct.pack("<II", 0x2000_5000, FLASH_BASE + 0x101) + bytes(range(256)) * 2


def hex_file(program: bytes, base: int = FLASH_BASE) -> str:
    def record(address: int, kind: int, payload: bytes) -> str:
        body = struct.pack(">BHB", len(payload), address, kind) + payload
        return f":{(body + bytes((-sum(body) & 0xFF,))).hex().upper()}\n"

    lines = record(0, 4, struct.pack(">H", base >> 16))
    for at in range(0, len(program), 16):
        lines += record(at, 0, program[at : at + 16])
    return lines + record(0, 5, struct.pack(">I", base + 0x101)) + record(0, 1, b"")


def test_hex_and_binary_files_have_the_same_program(tmp_path: Path) -> None:
    (tmp_path / "x.hex").write_text(hex_file(PROGRAM))
    (tmp_path / "x.BIN").write_bytes(PROGRAM)
    assert load_image(tmp_path / "x.hex").program == load_image(tmp_path / "x.BIN").program == PROGRAM


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
        ("x.bin", PROGRAM + bytes(FLASH_SIZE)),
        ("x.elf", PROGRAM),
    ],
)
def test_anything_else_is_refused_with_one_line(tmp_path: Path, name: str, contents: bytes) -> None:
    (tmp_path / name).write_bytes(contents)
    with pytest.raises(ImageError) as refused:
        load_image(tmp_path / name)
    assert name in str(refused.value)
    assert "\n" not in str(refused.value)
