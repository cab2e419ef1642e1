# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables on a terminal that is too narrow for them, and with the texts of others."""

import pytest
from rich.table import Column, Table

from terminal.printing import print_table
from tests.service.cli.test_check import FIELD, run


def test_on_a_narrow_terminal_every_value_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    wide = run(FIELD).stdout.partition("\n\n")[0].split()
    monkeypatch.setenv("COLUMNS", "40")
    assert set(wide) <= {*run(FIELD).stdout.partition("\n\n")[0].split(), *(word for word in wide if "─" in word)}


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
        assert "[b]Value" in printed
