# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths from other programs: KML and KMZ (Google Earth), GPX routes and tracks, CSV lists as Litchi writes them.

The points become waypoints. Such a file lacks a home, and often heights: then the reader asks for one, because a
guessed height would be flown.
"""

import csv
import io
import math
import re
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers.expat import ExpatError, ParserCreate

from protocols.mission_file.error import NO_HOME, MissionFileError, Note, file_degrees_to_e7, refuse_decimal_comma
from protocols.mission_item import Command, Frame, MissionItem
from protocols.plain_text import file_text, shown
from protocols.remedies import Fault

#: Characters. The parsed tree takes up to forty times the memory of the text.
_MAX_SIZE = 2 * 2**20
#: No program nests more. Without a limit, a search below each element would take the square of the file's size.
_MAX_DEPTH = 50
#: Characters parsed at once: other threads wait meanwhile.
_PIECE = 4096
_FEET = 0.3048
#: What is compressed by other methods unpacks all at once, however large.
_BOUNDED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
#: The frame of a height, by KML's altitudeMode. Heights of paths on the ground are meaningless.
_KML_MODES = {"relativetoground": Frame.GLOBAL_TERRAIN_ALT, "absolute": Frame.GLOBAL}
_CSV_LAT, _CSV_LON = ("latitude", "lat"), ("longitude", "lon", "lng", "long")
_CSV_ALT = {"altitude(m)": 1.0, "altitude": 1.0, "alt": 1.0, "height": 1.0, "altitude(ft)": _FEET}
_ABOVE_GROUND = "1"
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)", re.ASCII)


class _Point(NamedTuple):
    """A point of a path. alt_m: None if the file does not say."""

    where: str
    lat: str
    lon: str
    alt_m: float | None
    frame: Frame = Frame.GLOBAL_RELATIVE_ALT


class _Tree(TreeBuilder):
    """Names of elements and attributes lose their prefix and become lower-case."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name, self._depth = name, 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._depth += 1
        if self._depth > _MAX_DEPTH:
            raise MissionFileError(self._name, "", *Fault.DAMAGED_FILE(kind="XML"))
        return super().start(_plain(tag), {_plain(key): value for key, value in attrs.items()})

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(_plain(tag))


def _plain(name: str) -> str:
    return name.rpartition(":")[2].lower()


def parse_xml(text: str, name: str) -> Element:
    """The root element, with names as of `_Tree`.

    A document type is refused, because the entities in it can grow without limit or name other files.
    """
    if len(text) > _MAX_SIZE:
        raise MissionFileError(name, "", *Fault.LONG_XML())
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise MissionFileError(name, "", *Fault.DOCUMENT_TYPE())
    # ElementTree's own parser would repeat the namespace in each name, which takes the square of the file's size.
    parser, tree, text = ParserCreate(), _Tree(name), text.lstrip()
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = tree.start, tree.end, tree.data
    try:
        for start in range(0, len(text), _PIECE):
            parser.Parse(text[start : start + _PIECE], False)
        parser.Parse("", True)
        return tree.close()
    except ExpatError as error:
        raise MissionFileError(name, f"line {error.lineno}", *Fault.DAMAGED_FILE(kind="XML")) from None


def read_kml(root: Element, name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    """The only line of the file, or else its single points, in order."""
    lines = [element for element in root.iter() if element.tag == "linestring"]
    points = [element for element in root.iter() if element.tag == "point"]
    if len(lines) > 1:
        raise MissionFileError(name, "", *Fault.MANY_PATHS(count=len(lines), kind="paths"))
    found = [point for shape in lines or points for point in _kml_points(shape, name)]
    return _items(found, name, note, alt_m)


def read_kmz(data: bytes, name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    """A zipped KML."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            kmls = (each for each in archive.infolist() if each.filename.lower().endswith(".kml"))
            inside = next(each for each in kmls if each.compress_type in _BOUNDED)
            with archive.open(inside) as file:
                kml = file.read(_MAX_SIZE + 1)
    except StopIteration:
        raise MissionFileError(name, "", *Fault.NO_KML()) from None
    except (OSError, ValueError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError):
        raise MissionFileError(name, "", *Fault.DAMAGED_FILE(kind="KMZ")) from None
    return read_kml(parse_xml(file_text(kml), name), name, note, alt_m)


def read_gpx(root: Element, name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    """The only route, or else the only track, or else the waypoints. Heights are above sea level."""
    for kind, tag, point_tag in (("routes", "rte", "rtept"), ("tracks", "trk", "trkpt"), ("", "gpx", "wpt")):
        parts = [each for each in root.iter(tag) if each.find(f".//{point_tag}") is not None]
        if len(parts) > 1:
            raise MissionFileError(name, "", *Fault.MANY_PATHS(count=len(parts), kind=kind))
        if parts:
            return _items(list(_gpx_points(parts[0], point_tag, name)), name, note, alt_m)
    return _items([], name, note, alt_m)


def is_path_table(text: str) -> bool:
    """True if the first line names columns of latitude and longitude."""
    return _columns(text) is not None


def read_csv(text: str, name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    """A table with columns for latitude, longitude and altitude (m, or ft if the title says so).

    Litchi's altitudemode 1 means above the ground. Headings, gimbals and actions are left out.
    """
    columns = _columns(text)
    assert columns is not None
    separator, titles, lat, lon = columns
    alt = next((title for title in _CSV_ALT if title in titles), None)
    if same := next((title for title in (lat, lon, alt) if title is not None and titles.count(title) > 1), None):
        raise MissionFileError(name, "line 1", *Fault.SAME_TITLES(title=same))
    others = len(titles) - 2 - (alt is not None)
    points = []
    for number, row in enumerate(_rows(text, separator, name), start=1):
        if number == 1 or not any(row):
            continue
        where = f"line {number}"
        if len(row) != len(titles):
            raise MissionFileError(name, where, *Fault.UNEQUAL_ROW(count=len(row), wanted=len(titles)))
        cells = {title: cell.strip() for title, cell in zip(titles, row, strict=False)}
        if separator == ";":
            cells = {title: cell.replace(",", ".") for title, cell in cells.items()}
        height = None if alt is None else _number(cells[alt], alt, name, where) * _CSV_ALT[alt]
        is_above_ground = cells.get("altitudemode") == _ABOVE_GROUND
        frame = Frame.GLOBAL_TERRAIN_ALT if is_above_ground else Frame.GLOBAL_RELATIVE_ALT
        points.append(_Point(where, cells[lat], cells[lon], height, frame))
    if others:
        note(f"only latitude, longitude and altitude are read: {others} other columns are ignored")
    return _items(points, name, note, alt_m)


def _rows(text: str, separator: str, name: str) -> list[list[str]]:
    try:
        return [*csv.reader(text.splitlines(), delimiter=separator)]
    except csv.Error:
        raise MissionFileError(name, "", *Fault.DAMAGED_FILE(kind="table")) from None


def _columns(text: str) -> tuple[str, list[str], str, str] | None:
    """The separator, all titles, and those of latitude and longitude."""
    first = text.lstrip().partition("\n")[0]
    separator = max(",;\t", key=first.count)
    titles = [title.strip().strip('"').lower().replace(" ", "") for title in first.split(separator)]
    lat = next((title for title in _CSV_LAT if title in titles), None)
    lon = next((title for title in _CSV_LON if title in titles), None)
    return None if lat is None or lon is None else (separator, titles, lat, lon)


def _kml_points(shape: Element, name: str) -> Iterator[_Point]:
    mode = (shape.findtext("altitudemode") or "").strip().lower()
    frame = _KML_MODES.get(mode)
    for place, triple in enumerate((shape.findtext("coordinates") or "").split(), start=1):
        where = f"point {place}"
        fields = triple.split(",")
        if len(fields) not in (2, 3):
            raise MissionFileError(name, where, *Fault.NOT_A_PLACE(text=shown(triple)))
        has_height = frame is not None and len(fields) == 3
        alt_m = _number(fields[2], "the altitude", name, where) if has_height else None
        yield _Point(where, fields[1], fields[0], alt_m, Frame.GLOBAL if frame is None else frame)


def _gpx_points(part: Element, tag: str, name: str) -> Iterator[_Point]:
    for place, point in enumerate(part.iter(tag), start=1):
        where = f"point {place}"
        height = point.findtext("ele")
        alt_m = None if height is None else _number(height, "the elevation", name, where)
        yield _Point(where, point.get("lat", ""), point.get("lon", ""), alt_m, Frame.GLOBAL)


def _items(points: Sequence[_Point], name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    if not points:
        raise MissionFileError(name, "", *Fault.NO_PATH())
    if alt_m is None and (bare := next((point for point in points if point.alt_m is None), None)) is not None:
        raise MissionFileError(name, bare.where, *Fault.NO_ALTITUDE(name=name))
    items = [_item(0, Frame.GLOBAL, None, None, 0.0)]
    for point in points:
        lat_e7, lon_e7 = (
            file_degrees_to_e7(_number(text, what, name, point.where), what, name, point.where)
            for text, what in ((point.lat, "the latitude"), (point.lon, "the longitude"))
        )
        if alt_m is not None:
            items.append(_item(len(items), Frame.GLOBAL_RELATIVE_ALT, lat_e7, lon_e7, alt_m))
        else:
            items.append(_item(len(items), point.frame, lat_e7, lon_e7, point.alt_m or 0.0))
    note(NO_HOME)
    return items


def _item(seq: int, frame: Frame, lat_e7: int | None, lon_e7: int | None, alt_m: float) -> MissionItem:
    return MissionItem(seq, int(Command.NAV_WAYPOINT), int(frame), 0.0, 0.0, 0.0, 0.0, lat_e7, lon_e7, alt_m)


def _number(text: str, what: str, name: str, where: str) -> float:
    refuse_decimal_comma(text, name, where)
    number = text.strip()
    if not _NUMBER.fullmatch(number) or not math.isfinite(float(number)):
        raise MissionFileError(name, where, *Fault.NOT_A_NUMBER(what=what, text=shown(text)))
    return float(number)
