# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fly` with what it cannot fly: one sentence, exit code 2."""

import struct
from pathlib import Path

import pytest
from click.testing import CliRunner

from service.cli.fly import fly
from tests.support.programs import REPOSITORY

FIELD = str(REPOSITORY / "examples" / "naze-field.waypoints")


def run(*arguments: str) -> tuple[int, str]:
    # click keeps the help option that a command is first run with, and the page of all commands has both names.
    result = CliRunner().invoke(fly, arguments, help_option_names=["-h", "--help"])
    return result.exit_code, result.output


@pytest.fixture
def image(tmp_path: Path) -> str:
    """A program that loops for ever."""
    path = tmp_path / "loop.bin"
    path.write_bytes(struct.pack("<II", 0x2000_5000, 0x0800_0009) + b"\xfe\xe7")
    return str(path)


def test_an_image_that_does_not_answer_is_refused(image: str) -> None:
    code, output = run(FIELD, "--image", image)
    assert code == 2
    assert "does not answer" in output


def test_a_file_that_is_not_an_image_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.elf"
    path.write_bytes(b"no program")
    code, output = run(FIELD, "--image", str(path))
    assert code == 2
    assert "is not an ELF file" in output


def test_a_flash_of_another_size_is_refused(tmp_path: Path, image: str) -> None:
    path = tmp_path / "flash.img"
    path.write_bytes(bytes(1000))
    code, output = run(FIELD, "--image", image, "--flash", str(path))
    assert code == 2
    assert "1000 bytes" in output


def test_a_mission_that_would_be_rejected_is_refused(tmp_path: Path, image: str) -> None:
    path = tmp_path / "home.waypoints"
    path.write_text("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t45.3838\t8.4733\t131\t1\n")
    code, output = run(str(path), "--image", image)
    assert code == 2
    assert "home.waypoints" in output


@pytest.mark.parametrize(
    ("lie", "said"), [("compas=3", "'compas' is none of compass"), ("compass=x", "'x' is no number")]
)
def test_an_unknown_lie_is_refused(image: str, lie: str, said: str) -> None:
    code, output = run(FIELD, "--image", image, "--lie", lie)
    assert code == 2
    assert said in output


def test_a_missing_mission_is_refused(image: str) -> None:
    assert run("nowhere.waypoints", "--image", image)[0] == 2


def test_a_missing_image_is_named_without_an_error_number(image: str) -> None:
    code, output = run(FIELD, "--image", f"{image}x")
    assert code == 2
    assert f"{image}x" in output.replace("\n", "")
    assert "Errno" not in output
