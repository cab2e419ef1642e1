# SPDX-License-Identifier: GPL-3.0-or-later
"""What ground stations may make the bridge do, and how often.

Each limit is far above what a ground station needs and far below what hurts the pilot or the board.
"""

from dataclasses import dataclass
from enum import Enum, auto


@dataclass(frozen=True, slots=True)
class Rate:
    """So many a second in the long run, and so many at once."""

    per_s: float
    burst: float


class Cost(Enum):
    """What is limited.

    ANSWER: a message sent because it was asked for. Mission Planner asks for some twenty when it connects.
    TRANSFER: a message of a mission transfer; an item that is asked for at once comes a thousand times a second.
    TEXT: a STATUSTEXT that a station causes: a mission of 146 items may need one for each.
    BOARD: a question to the flight controller, which has a few hundred bytes a second to spare.
    PASSED: a frame for an autopilot that speaks MAVLink for itself, over a slow line.
    FLASH: a write to the board's flash, of which its pages take 10,000.
    STORED: a list that was not flown, kept in the store.
    RECORDED: a frame from a ground station in the telemetry log, of which the flight itself needs most.
    """

    ANSWER = auto()
    TRANSFER = auto()
    TEXT = auto()
    BOARD = auto()
    PASSED = auto()
    FLASH = auto()
    STORED = auto()
    RECORDED = auto()


@dataclass(frozen=True, slots=True)
class Limit:
    """For each peer, and for all peers together that have no standing of their own (bridge.gcs.budget)."""

    each: Rate
    total: Rate


LIMITS = {
    Cost.ANSWER: Limit(Rate(50, 200), Rate(500, 1000)),
    Cost.TRANSFER: Limit(Rate(1000, 2000), Rate(1000, 2000)),
    Cost.TEXT: Limit(Rate(5, 200), Rate(10, 300)),
    Cost.BOARD: Limit(Rate(4, 20), Rate(10, 40)),
    Cost.PASSED: Limit(Rate(200, 600), Rate(200, 600)),
    Cost.FLASH: Limit(Rate(1 / 20, 30), Rate(1 / 20, 60)),
    Cost.STORED: Limit(Rate(1 / 10, 20), Rate(1 / 5, 40)),
    Cost.RECORDED: Limit(Rate(50, 400), Rate(100, 800)),
}

#: What a ground station is told that goes over Cost.FLASH.
TOO_MANY_WRITES = "Too many writes to the board: wait a minute"
