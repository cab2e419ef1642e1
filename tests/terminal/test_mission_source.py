# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that `push` reads."""

from pathlib import Path

import pytest

from protocols.mission_file import write_qgc_wpl
from tests.service.cli.test_check import HOME, POINT, run


@pytest.mark.parametrize("name", ["", "[bold]x.waypoints", "ü.waypoints"])
def test_any_path_is_shown_unchanged(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name:
        path.write_text(write_qgc_wpl([HOME, POINT]))
        assert name in run(path).stdout.replace("\n", "")
    else:
        assert "Is a directory" in run(path).stderr


def test_a_device_is_refused() -> None:
    result = run("/dev/zero")
    assert result.exit_code == 2
    assert "not a regular file" in result.stderr
