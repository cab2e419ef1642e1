# SPDX-License-Identifier: GPL-3.0-or-later
"""The table in docs/mission-rules.md is up to date with the rules."""

from pathlib import Path

from generators.rules_page import table


def test_the_table_is_up_to_date() -> None:
    page = (Path(__file__).parents[2] / "docs" / "mission-rules.md").read_text()
    assert f"<!-- begin: make rules-page -->\n{table()}<!-- end: make rules-page -->" in page, "run make rules-page"
