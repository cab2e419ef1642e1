# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of other programs: KML, KMZ, GPX, CSV."""

import io
import tracemalloc
import zipfile
from contextlib import suppress

import pytest

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_item import Frame

POINTS = "0.0012,51.4771,30 0.0015,51.4772,40"
LITCHI = "latitude,longitude,altitude(m),heading(deg),altitudemode\n51.4771,0.0012,30,0,{0}\n51.4772,0.0015,40,0,{0}\n"


def kml(coordinates: str, mode: str = "relativeToGround", before: str = "") -> str:
    line = f"<LineString><altitudeMode>{mode}</altitudeMode><coordinates>\n{coordinates}\n</coordinates></LineString>"
    return (
        f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{before}<Placemark>{line}</Placemark></Document></kml>'
    )


def gpx(inside: str) -> str:
    return f'<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">{inside}</gpx>'


def track(tag: str, point: str, ele: str = "<ele>30</ele>") -> str:
    second = ele.replace("30", "40")
    points = (
        f'<{point} lat="51.4771" lon="0.0012">{ele}</{point}><{point} lat="51.4772" lon="0.0015">{second}</{point}>'
    )
    return f"<{tag}><trkseg>{points}</trkseg></{tag}>" if tag == "trk" else f"<{tag}>{points}</{tag}>"


def read(data: str | bytes, alt_m: float | None = None) -> list[tuple[int, int | None, int | None, float]]:
    """Frame, place and height of each waypoint; home is checked here."""
    home, *points = read_mission_file(data if isinstance(data, bytes) else data.encode(), "field", alt_m=alt_m)
    assert (home.seq, home.command, home.lat_e7, home.lon_e7) == (0, 16, None, None)
    assert [point.seq for point in points] == [*range(1, len(points) + 1)]
    return [(point.frame, point.lat_e7, point.lon_e7, point.alt_m) for point in points]


def flown(frame: Frame, *heights: float) -> list[tuple[int, int, int, float]]:
    return [(frame, 514771000, 12000, heights[0]), (frame, 514772000, 15000, heights[1])]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (kml(POINTS), flown(Frame.GLOBAL_TERRAIN_ALT, 30, 40)),
        (kml(POINTS, "absolute"), flown(Frame.GLOBAL, 30, 40)),
        (gpx(track("rte", "rtept")), flown(Frame.GLOBAL, 30, 40)),
        (gpx(track("trk", "trkpt")), flown(Frame.GLOBAL, 30, 40)),
        (gpx(track("rte", "rtept") + track("trk", "trkpt")), flown(Frame.GLOBAL, 30, 40)),
        (LITCHI.format(0), flown(Frame.GLOBAL_RELATIVE_ALT, 30, 40)),
        (LITCHI.format(1), flown(Frame.GLOBAL_TERRAIN_ALT, 30, 40)),
        (
            "Lat;Lon;Altitude (ft)\n51,4771;0,0012;100\n51,4772;0,0015;100\n",
            flown(Frame.GLOBAL_RELATIVE_ALT, 30.48, 30.48),
        ),
    ],
)
def test_reads_the_points_with_their_heights(text: str, expected: list[tuple[int, int, int, float]]) -> None:
    assert read(text) == expected
    assert read(text, alt_m=25) == flown(Frame.GLOBAL_RELATIVE_ALT, 25, 25)


def zipped(text: str, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("doc.kml", text)
    return packed.getvalue()


def test_reads_a_zipped_kml() -> None:
    assert read(zipped(kml(POINTS, "absolute"))) == flown(Frame.GLOBAL, 30, 40)


def test_a_kmz_with_one_damaged_byte_is_read_or_refused() -> None:
    whole = zipped(kml(POINTS, "absolute"))
    for place in range(len(whole)):
        for change in (1, 0x80):
            damaged = bytearray(whole)
            damaged[place] ^= change
            with suppress(MissionFileError):
                read(bytes(damaged))


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_zip_bomb_is_refused_before_it_is_unpacked(method: int) -> None:
    bomb = zipped("<kml>" + " " * (16 << 20), method)
    assert len(bomb) < 1 << 17
    tracemalloc.start()
    with pytest.raises(MissionFileError, match=r"longer than 2 MB|does not contain a KML"):
        read(bomb)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 12 << 20


def test_a_long_namespace_is_not_repeated_in_each_name() -> None:
    names = " ".join(f'p:a{number}=""' for number in range(5000))
    tracemalloc.start()
    with pytest.raises(MissionFileError, match="does not contain a path"):
        read(f'<gpx xmlns:p="{"u" * 65_536}"><b {names}/></gpx>')
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 12 << 20


@pytest.mark.parametrize(
    "text",
    [
        kml("0.0012,51.4771 0.0015,51.4772"),
        kml(POINTS, "clampToGround"),
        kml(POINTS).replace("<altitudeMode>relativeToGround</altitudeMode>", ""),
        gpx(track("trk", "trkpt", ele="")),
        "lat,lon\n51.4771,0.0012\n51.4772,0.0015\n",
    ],
)
def test_a_path_without_heights_needs_an_altitude(text: str) -> None:
    with pytest.raises(MissionFileError, match=r"no altitude; save it .*`naze-bridge convert field .* --alt METRES`"):
        read(text)
    assert read(text, alt_m=30) == flown(Frame.GLOBAL_RELATIVE_ALT, 30, 30)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (kml(POINTS, before="<LineString><coordinates>0,0,1 1,1,1</coordinates></LineString>"), "contains 2 paths"),
        (gpx(track("trk", "trkpt") * 2), "contains 2 tracks"),
        (kml("0.0012;51.4771;30"), "point 1: '0.0012;51.4771;30' is not LON,LAT,ALT"),
        (kml("0.0012,north,30"), "the latitude is 'north'"),
        ("<kml><Polygon><coordinates>1,2,3</coordinates></Polygon></kml>", "draw a path, not an area"),
        (gpx(""), "the file does not contain a path"),
        (kml("0,0012,51,4771,30"), "point 1: '0,0012,51,4771,30' is not LON,LAT,ALT; use decimal points"),
        (gpx(track("rte", "rtept")).replace("51.4771", "51,4771"), "point 1: '51,4771' has a decimal comma"),
        ("latitude,longitude,altitude(m)\n51.4771,0.0012\n", "line 2: 2 columns, but 3 titles"),
        ("latitude,longitude,altitude(m)\n51,4771,0,0012,30\n", "line 2: 5 columns, but 3 titles"),
        ("lat\tlon\talt\n51,4771\t0,0012\t30\n", "line 2: '51,4771' has a decimal comma"),
        (f"lat,lon,alt\n51.4771,0.0012,{'x' * 200_000}\n", "this table is damaged"),
        (b"PK\x03\x04" + bytes(60), "this KMZ is damaged"),
        (gpx("<trk>" * 51 + "</trk>" * 51), "this XML is damaged"),
    ],
)
def test_refuses_with_the_place_and_a_remedy(data: str | bytes, words: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read(data)
    assert words in str(caught.value)
