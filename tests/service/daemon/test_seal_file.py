# SPDX-License-Identifier: GPL-3.0-or-later
"""Seals survive a restart of the daemon: by the board's own number, else by its port."""

import json
from pathlib import Path

import pytest

from bridge.model.settings import BoardId, Seal
from protocols.msp.settings import Part
from service.daemon.seal_file import SEALS_FILE, SealFile

NUMBERED, NAMELESS = BoardId("INAV 9.1.0", "0011"), BoardId("Harakiri 2.1.1")
SEAL = Seal({Part.PIDS: b"\x28\x1e\x17", Part.MISC: b""})


def opened(folder: Path, port: str = "/dev/ttyAMA0") -> SealFile:
    return SealFile(folder, lambda: port)


def test_a_seal_is_kept_by_number_or_port(tmp_path: Path) -> None:
    file = opened(tmp_path)
    for board in (NUMBERED, NAMELESS):
        file.keep(board, SEAL)
    file.close()
    here, elsewhere = opened(tmp_path), opened(tmp_path, "/dev/ttyUSB0")
    assert [here.recall(board) for board in (NUMBERED, NAMELESS)] == [SEAL, SEAL]
    assert [elsewhere.recall(board) for board in (NUMBERED, NAMELESS)] == [SEAL, None]
    assert here.recall(BoardId("INAV 9.2.0", "0011")) is None


def test_the_oldest_boards_are_forgotten(tmp_path: Path) -> None:
    file = opened(tmp_path)
    for number in range(100):
        file.keep(NUMBERED, SEAL)
        file.keep(BoardId("INAV", f"{number:04x}"), SEAL)
    file.close()
    assert len(json.loads((tmp_path / SEALS_FILE).read_text())) == 32
    assert opened(tmp_path).recall(NUMBERED) == SEAL


@pytest.mark.parametrize("text", ["[]", '{"a": 1}', '{"a": {"PIDs": "x"}}', '{"a": {"wings": ""}}', "{"])
def test_a_damaged_file_is_forgotten(tmp_path: Path, text: str) -> None:
    (tmp_path / SEALS_FILE).write_text(text)
    assert opened(tmp_path).recall(NUMBERED) is None


def test_without_a_folder_seals_last_as_long_as_the_program() -> None:
    file = SealFile(None, lambda: "sim:")
    file.keep(NAMELESS, SEAL)
    assert file.recall(NAMELESS) == SEAL
    file.close()
