# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/mission-rules.md has the table that the rules make."""

from pathlib import Path

from bridge.controllers.harakiri.rules_page import table


def test_the_table_is_up_to_date() -> None:
    page = (Path(__file__).parents[1] / "docs" / "mission-rules.md").read_text()
    assert f"<!-- begin: make rules-page -->\n{table()}<!-- end: make rules-page -->" in page, "run make rules-page"
