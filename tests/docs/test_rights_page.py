# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables in docs/rights.md are up to date with protocols/rights/."""

from pathlib import Path

from generators.rights_page import filled, mavlink_table, msp_table


def test_the_tables_are_up_to_date() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rights.md").read_text()
    assert filled(page) == page, "run make rights-page"
    assert msp_table() in page
    assert mavlink_table() in page
