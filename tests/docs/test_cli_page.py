# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/cli.md is up to date with the commands' help."""

from pathlib import Path

from generators.cli_page import page


def test_the_page_is_up_to_date() -> None:
    assert (Path(__file__).parents[2] / "docs" / "cli.md").read_text() == page(), "run make cli-page"
