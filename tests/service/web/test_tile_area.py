# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from service.web.tile_area import TileArea, TileAreaError


def test_finer_levels_cover_the_same_area() -> None:
    levels = {level.zoom: level for level in TileArea(17, 1001, 2003, 2, 1).levels()}
    assert sorted(levels) == [13, 14, 15, 16, 17, 18]
    assert levels[18] == TileArea(18, 2002, 4006, 4, 2)
    assert levels[16] == TileArea(16, 500, 1001, 2, 1)
    assert levels[13] == TileArea(13, 62, 125, 1, 1)


def test_a_view_finer_than_what_is_kept_is_kept_as_it_is() -> None:
    assert TileArea(19, 5, 5, 1, 1).levels()[-1] == TileArea(19, 5, 5, 1, 1)


def test_columns_go_on_across_the_date_line() -> None:
    assert [*TileArea(3, 7, 2, 2, 1).tiles()] == [(3, 7, 2), (3, 0, 2)]
    assert TileArea(3, 7, 2, 2, 1).levels()[1] == TileArea(1, 1, 0, 2, 1)


@pytest.mark.parametrize(
    "numbers",
    [
        (20, 0, 0, 1, 1),
        (3, 8, 0, 1, 1),
        (3, 0, 8, 1, 1),
        (3, 0, 7, 1, 2),
        (3, 0, 0, 9, 1),
        (3, 0, 0, 0, 1),
        (3, 0, 0, 1, 0),
    ],
)
def test_numbers_that_are_not_on_the_map_are_refused(numbers: tuple[int, int, int, int, int]) -> None:
    with pytest.raises(TileAreaError):
        TileArea(*numbers)


@pytest.mark.parametrize("wrong", ["-1", "", "1.0", "../1", "9" * 4000, "\N{ARABIC-INDIC DIGIT ONE}", "0x1"])
def test_a_request_has_whole_numbers(wrong: str) -> None:
    query = {"zoom": "3", "x": "1", "y": "1", "columns": "1", "rows": "1"}
    assert TileArea.from_query(query) == TileArea(3, 1, 1, 1, 1)
    with pytest.raises(TileAreaError, match="whole numbers"):
        TileArea.from_query(query | {"y": wrong})
