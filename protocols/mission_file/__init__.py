# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission files as ground stations and other programs write them, recognised by their content."""

from collections.abc import Sequence
from pathlib import PurePath

from protocols.mission_file.error import MissionFileError, Note, no_note, refuse_stranger
from protocols.mission_file.nav_mission import has_wp_lines, read_nav_xml, read_wp_lines
from protocols.mission_file.path_file import is_path_table, parse_xml, read_csv, read_gpx, read_kml, read_kmz
from protocols.mission_file.qgc_plan import read_qgc_plan, write_qgc_plan
from protocols.mission_file.qgc_wpl import has_header, read_qgc_wpl, write_qgc_wpl
from protocols.mission_item import MissionItem
from protocols.plain_text import file_text, plain_text
from protocols.remedies import Fault

__all__ = ["MissionFileError", "read_mission_file", "write_mission_file", "write_qgc_wpl"]

#: Endings of other formats, as which a mission that is read from a board would not open.
_FOREIGN = frozenset((".kml", ".kmz", ".gpx", ".csv", ".mission", ".xml", ".json", ".param", ".tlog", ".bin"))


def write_mission_file(items: Sequence[MissionItem], name: str) -> str:
    """The items as a file's text: a QGroundControl plan if `name` ends with .plan, else QGC WPL 110.

    MissionFileError if the ending of `name` means another format.
    """
    ending = PurePath(name).suffix.lower()
    if ending in _FOREIGN:
        raise MissionFileError(name, "", *Fault.FOREIGN_ENDING(ending=ending))
    return write_qgc_plan(items) if ending == ".plan" else write_qgc_wpl(items)


def read_mission_file(data: bytes, name: str, note: Note = no_note, alt_m: float | None = None) -> list[MissionItem]:
    r"""Read the mission of a file in any format that we know, home as item 0.

    >>> plan = b"QGC WPL 110\n0 0 0 16 0 0 0 0 45.3 8.4 131 1\n1 0 3 16 0 0 0 0 45.4 8.5 20 1"
    >>> [(item.seq, item.lat_e7, item.alt_m) for item in read_mission_file(plan, "field.waypoints")]
    [(0, 453000000, 131.0), (1, 454000000, 20.0)]

    `note` is called for each thing that was fixed or left out. alt_m: the height above home of all points of a path
    (KML, GPX or CSV). MissionFileError is one sentence: the problem, the place in the file `name`, and the remedy.
    """
    if data.startswith(b"PK\x03\x04"):
        return read_kmz(data, name, note, alt_m)
    text = file_text(data)
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    if first.startswith("{"):
        return read_qgc_plan(text, name, note)
    if first.startswith("<") and not first.lower().startswith(("<html", "<!doctype html")):
        return _read_xml(text, name, note, alt_m)
    if has_header(first) or not first:
        return read_qgc_wpl(text, name, note)
    if has_wp_lines(text):
        return read_wp_lines(text, name, note)
    if not is_path_table(text):
        refuse_stranger(data, first, name)
    return read_csv(text, name, note, alt_m)


def _read_xml(text: str, name: str, note: Note, alt_m: float | None) -> list[MissionItem]:
    root = parse_xml(text, name)
    match root.tag:
        case "mission":
            return read_nav_xml(root, name, note)
        case "kml":
            return read_kml(root, name, note, alt_m)
        case "gpx":
            return read_gpx(root, name, note, alt_m)
    raise MissionFileError(name, "", *Fault.UNKNOWN_XML(tag=plain_text(root.tag)[:24]))
