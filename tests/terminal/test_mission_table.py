# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of missions on a terminal."""

import pytest

from tests.service.cli.test_check import FIELD, run


@pytest.mark.parametrize("columns", [10, 40])
def test_a_narrow_terminal_shortens_no_value(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def table() -> list[str]:
        return run(FIELD).stdout.partition("\n\n")[0].splitlines()

    monkeypatch.setenv("COLUMNS", "80")
    whole = table()
    assert "18.5->18" in whole[9]
    monkeypatch.setenv("COLUMNS", str(columns))
    assert table() == whole
