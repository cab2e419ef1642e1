# SPDX-License-Identifier: GPL-3.0-or-later
"""A setting: the autopilot whose MAVLink arrives on the port."""

from enum import Enum


class Autopilot(Enum):
    """AUTO: known from MSP on this port, or from its ids. HARAKIRI is translated, OTHER is passed through."""

    AUTO = "auto"
    HARAKIRI = "harakiri"
    OTHER = "other"
