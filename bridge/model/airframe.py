# SPDX-License-Identifier: GPL-3.0-or-later
"""The kind of aircraft; ground stations choose their screens and mode names by it."""

from collections.abc import Mapping
from enum import IntEnum


class Airframe(IntEnum):
    """MAVLink's MAV_TYPE."""

    FIXED_WING = 1
    QUADROTOR = 2
    HELICOPTER = 4
    ROVER = 10
    BOAT = 11
    HEXAROTOR = 13
    OCTOROTOR = 14
    TRICOPTER = 15


_MIXERS: Mapping[int, Airframe] = {
    1: Airframe.TRICOPTER,
    6: Airframe.HEXAROTOR,
    7: Airframe.HEXAROTOR,
    8: Airframe.FIXED_WING,
    10: Airframe.HEXAROTOR,
    11: Airframe.OCTOROTOR,
    12: Airframe.OCTOROTOR,
    13: Airframe.OCTOROTOR,
    14: Airframe.FIXED_WING,
    15: Airframe.HELICOPTER,
    16: Airframe.HELICOPTER,
    18: Airframe.HEXAROTOR,
}


def airframe(mixer: int) -> Airframe:
    """By MultiWii's MULTITYPE (Harakiri: mw.h). Others are shown as a quadrocopter."""
    return _MIXERS.get(mixer, Airframe.QUADROTOR)
