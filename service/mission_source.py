"""Mission files on disk."""

from pathlib import Path

import click

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_item import MissionItem

_MAX_BYTES = 8 * 2**20  # 65,535 items, the most that MAVLink can count, are about 5 MB of text


def load_mission(path: Path) -> list[MissionItem]:
    """Read the mission file at `path`; MissionFileError also where the disk says no."""
    name = click.format_filename(path)
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise MissionFileError(name, "", reason, "check the path and its permissions") from None
    if len(data) > _MAX_BYTES:
        what = f"larger than {_MAX_BYTES // 2**20} MB"
        raise MissionFileError(name, "", what, "this is no mission file, check the path")
    return read_mission_file(data, name)
