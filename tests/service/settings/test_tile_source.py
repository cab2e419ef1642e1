# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from service.settings.web import TileSource, parse_tile_source


@pytest.mark.parametrize(
    ("template", "origin"),
    [
        ("https://a.example/{z}/{x}/{y}.png", "https://a.example"),
        ("http://pi:8081/tile/{z}/{y}/{x}?key=abc", "http://pi:8081"),
    ],
)
def test_a_source_has_an_origin(template: str, origin: str) -> None:
    source = parse_tile_source(template)
    assert (source.origin, str(source)) == (origin, template)


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "tiles",
        "https://a.example?z={z}&x={x}&y={y}",
        "ftp://a.example/{z}/{x}/{y}",
        "https://a.example/{z}/{x}",
        "https://a.example/{z}/{x}/{y}/{y}",
        "https://a.example/{z}/{x}/{y}/{s}",
        "https://{z}.example/{x}/{y}",
        "https://me:secret@a.example/{z}/{x}/{y}",
        "https://a.example:99999/{z}/{x}/{y}",
        "https://a.example; script-src */{z}/{x}/{y}",
        "https://a.example/{z}/{x}/{y}\r\nHost: b",
        "https:///{z}/{x}/{y}",
    ],
)
def test_another_address_is_refused(wrong: str) -> None:
    with pytest.raises(match="is not an address of map tiles"):
        parse_tile_source(wrong)


def test_the_default_is_a_tile_source() -> None:
    assert parse_tile_source(str(TileSource())) == TileSource()
