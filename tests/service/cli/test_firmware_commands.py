# SPDX-License-Identifier: GPL-3.0-or-later
"""`firmware`: files that are refused, and a build without its tools; tests/e2e/test_firmware.py flashes."""

import os
from pathlib import Path

import pytest

from simulator.naze.whole_flash import stand_in
from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.programs import run_naze_bridge


@pytest.mark.parametrize(
    ("name", "contents", "status", "why"),
    [
        ("x.hex", b"junk", 2, "not an Intel HEX file"),
        ("x.bin", stand_in(patched=False), 1, "without the mission patch"),
    ],
)
def test_a_wrong_file_is_refused_without_a_daemon(
    tmp_path: Path, name: str, contents: bytes, status: int, why: str
) -> None:
    file = tmp_path / name
    file.write_bytes(contents)
    assert_one_sentence(run_naze_bridge("firmware", "flash", file, "--state-dir", tmp_path), status, why)


def test_a_missing_file_and_a_wrong_backup_are_reported_in_one_sentence(tmp_path: Path) -> None:
    assert_one_sentence(run_naze_bridge("firmware", "flash", tmp_path / "x.hex"), 2, "x.hex")
    part = tmp_path / "x.bin"
    part.write_bytes(stand_in(patched=True))
    assert_one_sentence(run_naze_bridge("firmware", "restore", part), 2, "a backup has 131072 bytes")


def tool(folder: Path, name: str, prints: str = "") -> None:
    path = folder / name
    path.write_text(f"#!/bin/sh\necho {prints}\n")
    path.chmod(0o755)


def build(checkout: Path, tools: Path) -> list[str]:
    environment = {**os.environ, "PATH": str(tools)}
    ended = run_naze_bridge("firmware", "build", checkout, env=environment)
    assert ended.returncode == 1, ended
    return ended.stderr.split()


def test_missing_tools_are_named_by_their_packages(tmp_path: Path) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    packages = ["gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "make"]
    assert build(tmp_path, tools)[-3:] == packages
    tool(tools, "make")
    tool(tools, "arm-none-eabi-gcc", "libc.a")
    assert build(tmp_path, tools)[-3:] == ["apt", "install", "libnewlib-arm-none-eabi"]


def test_a_folder_without_harakiri_is_refused_by_the_patch(tmp_path: Path) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    tool(tools, "make")
    tool(tools, "arm-none-eabi-gcc", "/usr/lib/libc.a")
    assert build(tmp_path, tools)[0] == "apply:"
