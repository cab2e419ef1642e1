# SPDX-License-Identifier: GPL-3.0-or-later
"""A latitude or longitude in a mission file: degrees, or not given."""

import math

from protocols.file_error import shown
from protocols.mission_file.error import MissionFileError
from protocols.mission_item import degrees_to_e7


def file_degrees_to_e7(degrees: float, field: str, name: str, where: str) -> int | None:
    """Degrees * 1e7, None for NaN (not given); MissionFileError if out of range.

    The rules treat an infinite coordinate as missing, because a ground station may send it; in a file it is damage.
    """
    e7 = degrees_to_e7(degrees)
    if e7 is None and not math.isnan(degrees):
        raise MissionFileError(name, where, f"{field} is {shown(degrees)}", "give it in degrees")
    return e7
