# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of missions on a terminal."""

import pytest

from tests.service.cli.test_check import FIELD, run


def test_changed_and_dropped_items_are_shown_side_by_side_in_80_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    _, header, _, *rows = run(FIELD).stdout.partition("\n\n")[0].splitlines()
    assert header.split() == ["WP", "Command", "p1", "p2", "p3", "p4", "Latitude", "Longitude", "Height"]
    assert max(map(len, rows)) <= 80
    assert any(row.startswith("  5->- DO_CHANGE_SPEED") for row in rows)
    assert any(row.endswith("18.5->18") for row in rows)
