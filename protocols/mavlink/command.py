# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink's commands: their names, and the result field of COMMAND_ACK."""

from enum import IntEnum

from protocols.mavlink.dialect import messages


class CommandResult(IntEnum):
    """MAV_RESULT (https://mavlink.io/en/messages/common.html#MAV_RESULT)."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


def command_name(command: int) -> str:
    """A MAV_CMD's name as Mission Planner lists it, or its number."""
    known = messages.enums["MAV_CMD"].get(command)
    return str(command) if known is None else known.name.removeprefix("MAV_CMD_").removeprefix("NAV_")
