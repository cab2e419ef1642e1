# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables on a terminal that is too narrow for them, and with the texts of others."""

import pytest
from rich.table import Column, Table

from terminal.printing import print_table
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


def test_names_that_look_like_markup_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("Name", Column("[b]Value", justify="right"), caption="[/z]")
    table.add_row("[/x]", "[link=http://e]L")
    table.add_row(":smile:", "[red]1")
    for width in ("80", "20"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("COLUMNS", width)
            print_table(table)
        printed = capsys.readouterr().out
        assert all(text in printed for text in ("[/x]", "[link=http://e]L", ":smile:", "[red]1", "[/z]"))
        assert ("[b]Value" in printed) is (width == "80")
