# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables on a terminal that is too narrow for them."""

import pytest

from tests.service.cli.test_check import FIELD, run


def test_on_a_narrow_terminal_each_row_is_a_paragraph_with_every_value_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    (title, *_), *rest = [line.split() for line in run(FIELD).stdout.partition("\n\n")[0].splitlines()]
    values = {word for line in rest[2:] for word in line} - {"-"}
    monkeypatch.setenv("COLUMNS", "40")
    narrow = run(FIELD).stdout.partition("\n\n")[0].removeprefix(f"{title}\n")
    assert [line for line in narrow.splitlines() if len(line) > 40] == []
    words = {word.rpartition("=")[2].rstrip(",") for word in narrow.split()}
    assert {value.removeprefix("->") for value in values} - words <= {
        "18.5",
        "400",
    }  # the first line of a changed value
    assert "WP 7->6 WAYPOINT\n  p1=3->1, p2=4, p3=0, p4=0," in narrow
    assert "18.5->18" in narrow
