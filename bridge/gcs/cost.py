# SPDX-License-Identifier: GPL-3.0-or-later
"""The limits on the work that ground stations may cause.

Each limit is far above a ground station's needs and far below a load that would hurt the pilot or the board.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Self


@dataclass(frozen=True, slots=True)
class Rate:
    """A sustained rate per second, and a burst size."""

    per_s: float
    burst: float


class Cost(IntEnum):  # hashed for each datagram: as an int, in C
    """The limited kinds of work. Two limits: for a station or host with its own budget, and for all others together.

    RECEIVED: a datagram or a read from a connection.
    ARRIVAL: a new peer, which costs greetings and a log entry.
    ANSWER: a message sent on request. Mission Planner requests about sixty when it connects, most of them parameters.
    LIST: a list of all parameters, several hundred messages.
    TRANSFER: a message of a mission transfer; over a fast link there may be a thousand items a second.
    TEXT: a STATUSTEXT that a station causes; a mission of 146 items may need one for each.
    UPLOAD: a list that is announced, which costs log entries.
    BOARD: a request to the flight controller, which has a few hundred bytes a second to spare.
    PASSED: a frame for an autopilot that speaks MAVLink itself, over a slow line.
    COPIED: a copy of a station's frame for another station, alongside such an autopilot.
    STORED: a list in the store that did not reach the flight controller.
    RECORDED: a ground station's frame in the telemetry log, whose space is mostly for the flight itself.
    """

    each: Rate
    total: Rate

    def __new__(cls, each: Rate, total: Rate) -> Self:
        cost = int.__new__(cls, len(cls.__members__))
        cost._value_, cost.each, cost.total = int(cost), each, total
        return cost

    RECEIVED = Rate(1500, 3000), Rate(15000, 15000)
    ARRIVAL = Rate(5, 32), Rate(50, 200)
    ANSWER = Rate(50, 600), Rate(500, 3000)
    LIST = Rate(1 / 2, 10), Rate(2, 40)
    TRANSFER = Rate(1000, 2000), Rate(1000, 8000)
    TEXT = Rate(5, 200), Rate(10, 300)
    UPLOAD = Rate(10, 50), Rate(10, 400)
    BOARD = Rate(4, 20), Rate(10, 40)
    PASSED = Rate(200, 600), Rate(200, 600)
    COPIED = Rate(150, 300), Rate(150, 300)
    STORED = Rate(1 / 10, 20), Rate(1 / 5, 40)
    RECORDED = Rate(50, 400), Rate(100, 800)


#: Hosts with a budget of their own.
SEATS = 16
#: Writes to the flash (bridge.gcs.flash_budget) for each seat, and for all hosts without one: 17 times 2 at once, and
#: 17 times 1 in two hours.
FLASH_RESERVE = Rate(1 / 7200, 2)
#: For all: with the reserves it makes 400 at once, and 12 an hour.
FLASH_SHARED = Rate(3.5 / 3600, 366)
FLASH_PROVEN = Rate(1 / 300, 400)
