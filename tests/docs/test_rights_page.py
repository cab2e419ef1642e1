# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables in docs/rights.md are up to date with protocols/rights/."""

from pathlib import Path

from generators.rights_page import msp_table


def test_the_table_is_up_to_date() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rights.md").read_text()
    assert f"<!-- begin: make rights-page -->\n{msp_table()}<!-- end: make rights-page -->" in page, (
        "run make rights-page"
    )
