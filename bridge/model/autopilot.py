# SPDX-License-Identifier: GPL-3.0-or-later
"""The autopilot whose MAVLink arrives on the port: a setting."""

from enum import Enum


class Autopilot(Enum):
    """Whose MAVLink is heard on the port."""

    AUTO = "auto"
    HARAKIRI = "harakiri"
    OTHER = "other"
