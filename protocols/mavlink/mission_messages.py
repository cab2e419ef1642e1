# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts MissionItem to and from MISSION_ITEM and MISSION_ITEM_INT (https://mavlink.io/en/services/mission.html)."""

from dataclasses import replace

from protocols.mavlink.dialect import Message, messages
from protocols.mission_item import MissionItem, degrees_to_e7


def item_from_float_message(message: Message) -> MissionItem:
    """Read MISSION_ITEM: its coordinates are float degrees."""
    return replace(item_from_int_message(message), lat_e7=degrees_to_e7(message.x), lon_e7=degrees_to_e7(message.y))


def item_from_int_message(message: Message) -> MissionItem:
    """Read MISSION_ITEM_INT: its coordinates are exact."""
    params = (message.param1, message.param2, message.param3, message.param4)
    return MissionItem(message.seq, message.command, message.frame, *params, message.x, message.y, message.z)


def item_message(item: MissionItem, sysid: int, compid: int, *, as_int: bool) -> Message:
    """Make the message for one item, addressed to a ground station."""
    lat_e7, lon_e7 = item.lat_e7 or 0, item.lon_e7 or 0
    make = messages.MAVLink_mission_item_int_message if as_int else messages.MAVLink_mission_item_message
    x, y = (lat_e7, lon_e7) if as_int else (lat_e7 / 1e7, lon_e7 / 1e7)
    params = (item.p1, item.p2, item.p3, item.p4)
    return make(sysid, compid, item.seq, item.frame, item.command, 0, 1, *params, x, y, item.alt_m, 0)
