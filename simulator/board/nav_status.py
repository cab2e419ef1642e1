# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP_NAV_STATUS in MultiWii's numbers, which INAV kept and extended (mwState, mwError)."""

import struct
from dataclasses import dataclass
from enum import IntEnum


class Mode(IntEnum):
    """The first byte."""

    NONE = 0
    HOLD = 1
    RTH = 2
    NAV = 3


class State(IntEnum):
    """The second byte. HOVER_ABOVE_HOME is INAV's."""

    NONE = 0
    RTH_START = 1
    RTH_ENROUTE = 2
    HOLD_INFINIT = 3
    HOLD_TIMED = 4
    WP_ENROUTE = 5
    PROCESS_NEXT = 6
    DO_JUMP = 7
    LAND_START = 8
    LAND_IN_PROGRESS = 9
    LANDED = 10
    LAND_SETTLE = 11
    LAND_START_DESCENT = 12
    HOVER_ABOVE_HOME = 13


class Error(IntEnum):
    """The fifth byte."""

    NONE = 0
    TOO_FAR = 1
    WP_CRC = 3
    FINISH = 4
    TIMEWAIT = 5
    INVALID_JUMP = 6
    INVALID_DATA = 7
    DISARMED = 10
    LANDING = 11


@dataclass(frozen=True, slots=True)
class NavStatus:
    """`number`: of the waypoint, from 1. `heading`: the target heading, degrees."""

    mode: Mode
    state: State
    action: int
    number: int
    error: Error
    heading: int = 0

    def pack(self) -> bytes:
        return struct.pack("<5Bh", self.mode, self.state, self.action, self.number & 0xFF, self.error, self.heading)
