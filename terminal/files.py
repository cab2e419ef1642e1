# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that the user names, read and written whole. Errors are the caller's kind of FileError."""

import errno
import os
from collections.abc import Sequence
from pathlib import Path

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_file.error import NO_HOME
from protocols.mission_item import MissionItem
from protocols.plain_text import FileError, plain_text
from protocols.remedies import Fault
from storage.os_error import reason
from storage.small_files import read_bounded, replace_file
from terminal.sentences import complain

MAX_BYTES = 8 * 2**20  # 65,535 items, the most that MAVLink can count, are about 5 MB of text


def shown_path(path: Path) -> str:
    """The path in messages: any program may have made the file's name."""
    return plain_text(str(path))


def read_file(path: Path, failure: type[FileError]) -> bytes:
    """The contents. `failure` if the file cannot be read."""
    try:
        return read_bounded(path, MAX_BYTES)
    except (OSError, ValueError) as error:
        raise _failed(path, error, failure) from None


def load_mission(path: Path, alt_m: float | None = None, *, has_home: bool = False) -> list[MissionItem]:
    """Read the mission file at `path`. MissionFileError if it or the disk is damaged. Notes go to standard error.

    alt_m: the height above home of all points of a path (KML, GPX or CSV). has_home: True if a person gives home.
    """
    name = shown_path(path)

    def note(text: str) -> None:
        if not (has_home and text == NO_HOME):
            complain(f"{name}, {text}")

    return read_mission_file(read_file(path, MissionFileError), name, note, alt_m)


def assumed_home(items: Sequence[MissionItem], name: str) -> tuple[int, int] | None:
    """The place of the first waypoint, if a list that is checked offline lacks a home; degrees * 1e7."""
    if items[0].lat_e7 or items[0].lon_e7:
        return None
    complain(f"{name}, home is assumed at the first waypoint; `naze-bridge check --home LAT,LON` sets it")
    return next(((item.lat_e7, item.lon_e7) for item in items if item.lat_e7 and item.lon_e7), None)


def write_file(path: Path, text: str, failure: type[FileError]) -> None:
    """Write a file in one step: a full disk must not destroy the old file. `failure` if that fails.

    A link stays a link, and only regular files are replaced: as root, renaming over a device would destroy it.
    """
    try:
        target = Path(os.path.realpath(path))  # still a link if it leads to itself
        if target.is_symlink() or (target.exists() and not target.is_file()):
            raise failure(shown_path(path), "", *Fault.NO_FILE(why="it is not a regular file"))
        replace_file(target, text.encode(), 0o644)
    except (OSError, ValueError) as error:
        raise _failed(path, error, failure) from None


def _failed(path: Path, error: OSError | ValueError, failure: type[FileError]) -> FileError:
    number = getattr(error, "errno", None)  # None if the file is too large, or not a regular file
    others = Fault.NO_FILE if number is None else Fault.UNREADABLE_FILE
    fault = Fault.FULL_DISK if number in (errno.ENOSPC, errno.EDQUOT) else others
    return failure(shown_path(path), "", *fault(why=reason(error)))
