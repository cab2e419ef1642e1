# SPDX-License-Identifier: GPL-3.0-or-later
"""A small JSON file: damage is reported and ignored."""

import os
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from service.links.port_finder import PORTS_FILE, PortMemory
from service.machine.state_file import StateFile


@pytest.mark.parametrize("content", ["[" * 100_000, "[1, 2]", "1e999"])
def test_any_damage_is_reported_and_ignored(tmp_path: Path, content: str) -> None:
    (tmp_path / "state.json").write_text(content)
    with capture_logs() as logged:
        assert (
            StateFile(tmp_path, "state.json", "").load(lambda kept: kept[2] if isinstance(kept, list) else int(kept))
            is None
        )
    assert [entry["event"] for entry in logged] == ["state.lost"]


@pytest.mark.parametrize("content", ["", "[]", '{"others": {}}', "\xff"])
def test_a_damaged_file_is_reported_and_ignored(tmp_path: Path, content: str) -> None:
    (tmp_path / PORTS_FILE).write_bytes(content.encode("latin-1"))
    with capture_logs() as logged:
        memory = PortMemory(tmp_path)
    assert memory.flight_controller == ""
    assert [entry["event"] for entry in logged] == ["state.lost"]


def test_a_pipe_in_place_of_the_file_does_not_delay_the_start(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "state.json")
    with capture_logs() as logged:
        assert StateFile(tmp_path, "state.json", "").load(list) is None
    assert [entry["event"] for entry in logged] == ["state.lost"]


def test_the_latest_contents_are_loaded_again(tmp_path: Path) -> None:
    file = StateFile(tmp_path, "numbers.json", "the numbers are forgotten")
    for number in range(20):
        file.save([number])
    file.close()
    again = StateFile(tmp_path, "numbers.json", "the numbers are forgotten")
    assert again.load(list) == [19]
    again.close()
