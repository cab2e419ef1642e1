# SPDX-License-Identifier: GPL-3.0-or-later

import pytest

from service.settings.addresses import AddressError
from service.settings.web import TileSource, parse_tile_source


@pytest.mark.parametrize(
    ("template", "origin", "target"),
    [
        ("https://a.example/{z}/{x}/{y}.png", "https://a.example", "/3/1/2.png"),
        ("http://pi:8081/tile/{z}/{y}/{x}?key=abc", "http://pi:8081", "/tile/3/2/1?key=abc"),
        ("https://a.example?z={z}&x={x}&y={y}", None, None),
    ],
)
def test_a_tile_has_an_address(template: str, origin: str | None, target: str | None) -> None:
    if origin is None:
        with pytest.raises(AddressError):
            parse_tile_source(template)
        return
    source = parse_tile_source(template)
    assert (source.origin, source.target(3, 1, 2), str(source)) == (origin, target, template)
    assert f"{source.origin.partition('://')[2]}" == source.host


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "tiles",
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


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("tile.openstreetmap.org", True),
        ("openstreetmap.org", True),
        ("a.tile.OpenStreetMap.org:443", True),
        ("openstreetmap.org.example", False),
        ("myopenstreetmap.org", False),
    ],
)
def test_openstreetmaps_own_server_is_known(host: str, *, expected: bool) -> None:
    assert parse_tile_source(f"https://{host}/{{z}}/{{x}}/{{y}}.png").is_openstreetmap is expected


def test_the_default_is_a_tile_source() -> None:
    assert parse_tile_source(str(TileSource())) == TileSource()
