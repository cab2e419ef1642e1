# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission files as ground stations write them."""

from collections.abc import Sequence

from protocols.mission_file.error import MissionFileError, Note, no_note
from protocols.mission_file.qgc_plan import read_qgc_plan, write_qgc_plan
from protocols.mission_file.qgc_wpl import read_qgc_wpl, write_qgc_wpl
from protocols.mission_item import MissionItem

__all__ = ["MissionFileError", "read_mission_file", "write_mission_file", "write_qgc_wpl"]


def write_mission_file(items: Sequence[MissionItem], name: str) -> str:
    """The items as a file's text: a QGroundControl plan if `name` ends with .plan, else QGC WPL 110."""
    return write_qgc_plan(items) if _is_plan(name) else write_qgc_wpl(items)


def read_mission_file(data: bytes, name: str, note: Note = no_note) -> list[MissionItem]:
    """Read a QGC WPL 110, a QGroundControl plan or Mission Planner's JSON, recognised by content; home is item 0.

    `note` is called for each thing that was fixed. MissionFileError is one sentence: the problem, its place in the file
    `name`, and the remedy.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        remedy = "give a QGC WPL 110 (.waypoints) or a QGroundControl plan (.plan), saved as UTF-8"
        raise MissionFileError(name, f"line {line}", "this is not UTF-8 text", remedy) from None
    read = read_qgc_plan if text.lstrip().startswith("{") or _is_plan(name) else read_qgc_wpl
    return read(text, name, note)


def _is_plan(name: str) -> bool:
    return name.lower().endswith(".plan")
