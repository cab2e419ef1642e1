# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission files on disk."""

from pathlib import Path

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_item import MissionItem
from terminal.files import read_file, shown_path
from terminal.sentences import complain


def load_mission(path: Path, alt_m: float | None = None) -> list[MissionItem]:
    """Read the mission file at `path`; MissionFileError if it or the disk is damaged. Notes go to standard error.

    alt_m: the height above home of all points of a path (KML, GPX or CSV).
    """
    name = shown_path(path)

    def note(text: str) -> None:
        complain(f"{name}, {text}")

    return read_mission_file(read_file(path, MissionFileError), name, note, alt_m)
