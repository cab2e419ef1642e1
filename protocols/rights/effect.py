# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of a request on a flight controller."""

from enum import StrEnum


class Effect(StrEnum):
    """From harmless to unknown. A mission's upload is a CHANGE; its start is a MOVE."""

    #: The flight controller replies and is otherwise as before.
    READ = "read"
    #: Changes its settings, mission, calibration or memory.
    CHANGE = "change"
    #: Arms or moves the craft, restarts it, or stands in for its transmitter, sensors, receiver or port.
    MOVE = "move"
    #: No firmware's handler is known for it.
    UNKNOWN = "unknown"
