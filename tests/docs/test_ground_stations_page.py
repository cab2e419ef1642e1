# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts in docs/ground-stations.md are those of the table of sentences."""

from pathlib import Path

from generators.ground_stations_page import texts


def test_the_texts_are_up_to_date() -> None:
    page = (Path(__file__).parents[2] / "docs" / "ground-stations.md").read_text()
    begin, end = "<!-- begin: make ground-stations-page -->", "<!-- end: make ground-stations-page -->"
    assert f"{begin}\n{texts()}{end}" in page, "run make ground-stations-page"
