# SPDX-License-Identifier: GPL-3.0-or-later
"""The last settings survive a restart of the daemon: by the board's own number, else by its port."""

import json
from pathlib import Path

import pytest

from bridge.model.settings import BoardId, Value
from service.daemon.kept_state import SETTINGS_FILE, LastSettings

NUMBERED, NAMELESS = BoardId("INAV 9.1.0", "0011"), BoardId("Harakiri 2.1.1")
VALUES: dict[str, Value] = {"p_roll": 44, "snr_cf": 0.125, "name": "text"}


def opened(folder: Path, port: str = "/dev/ttyAMA0") -> LastSettings:
    return LastSettings(folder, lambda: port)


def test_settings_are_kept_by_number_or_port(tmp_path: Path) -> None:
    file = opened(tmp_path)
    for board in (NUMBERED, NAMELESS):
        file[board] = VALUES
    file.close()
    here, elsewhere = opened(tmp_path), opened(tmp_path, "/dev/ttyUSB0")
    assert [here.get(board, {}) for board in (NUMBERED, NAMELESS)] == [VALUES, VALUES]
    assert [elsewhere.get(board, {}) for board in (NUMBERED, NAMELESS)] == [VALUES, {}]
    assert here.get(BoardId("INAV 9.2.0", "0011"), {}) == {}


def test_the_oldest_boards_are_forgotten(tmp_path: Path) -> None:
    file = opened(tmp_path)
    for number in range(100):
        file[NUMBERED] = {"p_roll": float(number)}
        file[BoardId("INAV", f"{number:04x}")] = VALUES
    file.close()
    assert len(json.loads((tmp_path / SETTINGS_FILE).read_text())) == 16
    assert opened(tmp_path).get(NUMBERED, {}) == {"p_roll": 99.0}


@pytest.mark.parametrize("text", ["[]", '{"a": 1}', '{"INAV 9.1.0, 0011": {"p_roll": [1]}}', "{"])
def test_a_damaged_file_is_forgotten(tmp_path: Path, text: str) -> None:
    (tmp_path / SETTINGS_FILE).write_text(text)
    assert opened(tmp_path).get(NUMBERED, {}) == {}


def test_without_a_folder_settings_last_as_long_as_the_program() -> None:
    file = LastSettings(None, lambda: "sim:")
    file[NAMELESS] = VALUES
    assert file.get(NAMELESS, {}) == VALUES
    file.close()
