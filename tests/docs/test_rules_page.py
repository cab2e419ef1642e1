# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables in docs/mission-rules.md are up to date, and name tests that exist."""

from pathlib import Path

import pytest

from generators.rules_page import FLIGHTS, flights, table

_ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("name", "text"), [("rules-page", table()), ("rules-page flights", flights())])
def test_the_table_is_up_to_date(name: str, text: str) -> None:
    page = (_ROOT / "docs" / "mission-rules.md").read_text()
    assert f"<!-- begin: make {name} -->\n{text}<!-- end: make {name} -->" in page, "run make rules-page"


def test_each_rule_names_an_existing_test_or_its_source() -> None:
    for by in {*FLIGHTS.values()}:
        file, _, name = by.partition("::")
        opening = f"\nstatic void {name}(" if file.endswith(".c") else f"\ndef {name}("
        assert opening in (_ROOT / file).read_text() if name else by.startswith("source: "), by
