# SPDX-License-Identifier: GPL-3.0-or-later
"""The result field of COMMAND_ACK (https://mavlink.io/en/messages/common.html#MAV_RESULT)."""

from enum import IntEnum


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
