# SPDX-License-Identifier: GPL-3.0-or-later
"""The names of mission commands for people."""

from protocols.mavlink.dialect import messages


def command_name(command: int) -> str:
    """Return a MAV_CMD's name as Mission Planner lists it, or its number."""
    entry = messages.enums["MAV_CMD"].get(command)
    return str(entry.name).removeprefix("MAV_CMD_").removeprefix("NAV_") if entry else str(command)
