# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of docs/mission-rules.md, from the rules themselves (`make rules-page`)."""

import sys

from bridge.controllers.harakiri.rules import (
    TAKEOFF_MAX_M,
    USUAL_WP_RADIUS_CM,
    CommandRule,
    InList,
    command_rules,
)
from bridge.missions.list_check import UNUSED, Range
from protocols.mavlink.dialect import command_name
from protocols.mission_item import ROI_COMMANDS, Command

_PLACES = {
    InList.ANY: "any",
    InList.ITEM_1: "only item 1",
    InList.LAST: "only last",
    InList.NOT_LAST: "not last",
}


def table() -> str:
    """The table for a board with the default settings."""
    rows = ["| command | param1 | Hit Rad, m | param4 | Lat, Long | Alt, m | place |", "|---|---|---|---|---|---|---|"]
    for command, rule in command_rules(USUAL_WP_RADIUS_CM, TAKEOFF_MAX_M).items():
        if command not in ROI_COMMANDS or command == Command.NAV_ROI:
            rows.append(_row(command, rule))
    return "\n".join(rows) + "\n"


def _row(command: int, rule: CommandRule) -> str:
    numbers = sorted(ROI_COMMANDS) if command in ROI_COMMANDS else [command]
    names = ", ".join(f"{command_name(number)} {number}" for number in numbers)
    cells = (names, *map(_range, (rule.p1, rule.p2, rule.p4)), "needed" if rule.position else "0", _range(rule.height))
    place = _PLACES[rule.place] + ("" if rule.alone else ", not alone")
    return f"| {' | '.join((*cells, place))} |"


def _range(allowed: Range) -> str:
    if allowed is UNUSED:
        return "0"
    instead = f"; 0 becomes {allowed.instead_of_zero}" if allowed.instead_of_zero else ""
    return f"{allowed.low}..{allowed.high}{instead}"


if __name__ == "__main__":
    sys.stdout.write(table())
