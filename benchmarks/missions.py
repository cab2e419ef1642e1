# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions of 146 items that the rules accept unchanged, no two alike."""

import random

from bridge.controllers.harakiri.rules import items_from_records
from protocols.mission_item import MissionItem
from protocols.msp.mission import WpCommand, WpRecord

COUNT = 146
_COMMANDS = (WpCommand.WAYPOINT, WpCommand.LOITER_TURNS, WpCommand.LOITER_TIME)


def random_mission(seed: int) -> list[MissionItem]:
    """Home and 145 commands anywhere on earth, so that the bytes of coordinates take all values."""
    chance = random.Random(seed)
    return items_from_records(_record(chance, WpCommand.WAYPOINT if seq == 0 else None) for seq in range(COUNT))


def _record(chance: random.Random, command: WpCommand | None) -> WpRecord:
    command = chance.choice(_COMMANDS) if command is None else command
    return WpRecord(
        lat_e7=chance.randint(1, 80 * 10**7) * chance.choice((-1, 1)),
        lon_e7=chance.randint(1, 179 * 10**7) * chance.choice((-1, 1)),
        height_m=chance.randint(2, 3000),
        roi_heading=0,
        time={WpCommand.WAYPOINT: chance.randint(0, 1), WpCommand.LOITER_TIME: chance.randint(1, 255)}.get(command, 0),
        radius_m=chance.randint(2, 255),
        turns=chance.choice((-1, 1)) * chance.randint(1, 127) if command is WpCommand.LOITER_TURNS else 0,
        command=command,
    )
