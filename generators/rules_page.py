# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of docs/mission-rules.md: the rules themselves, and what confirms each (`make rules-page`)."""

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

_CORE = "tests/bridge/controllers/harakiri/test_flight.py"
_FLOWN = "tests/firmware/test_firmware_core.py::test_random_missions_are_flown_as_the_manual_says"
_SITL = "tests/real_inav/test_sitl.py"
#: Each rule about the flight, and the test that confirms it by a flight, or a place in INAV 9.1.0 (src/main).
FLIGHTS = {
    "Harakiri: first place, leg, height, from the craft or the list's home": (
        f"{_CORE}::test_the_core_refuses_exactly_the_reported_lists"
    ),
    "Harakiri: mission_radius, and random lists": f"{_CORE}::test_exactly_the_refusals_of_the_core_are_reported",
    "Harakiri: public missions": f"{_CORE}::test_the_core_refuses_no_public_mission_without_a_word",
    "Harakiri: each command of the table, the order, heights, holds and turns": _FLOWN,
    "Harakiri: the height of RETURN_TO_LAUNCH, LAND where it is": _FLOWN,
    "INAV: nav_wp_max_safe_distance, also of a ROI; jumps": (
        f"{_SITL}::test_it_arms_exactly_with_the_lists_that_the_rules_accept"
    ),
    "INAV: nav_max_altitude": f"{_SITL}::test_above_nav_max_altitude_it_would_fly_lower_and_the_list_is_refused",
    "INAV: nav_max_auto_speed, speed of a leg": f"{_SITL}::test_a_leg_is_flown_at_the_speed_that_is_said",
    "INAV: RTL that lands, or not": f"{_SITL}::test_a_return_lands_only_if_the_param1_says_so",
    "INAV: arming in and outside of geozones": f"{_SITL}::test_it_arms_exactly_in_the_zones_that_the_rules_accept",
    "INAV: geozone on the way, with an action or without": f"{_SITL}::test_a_mission_stops_at_a_zone_as_said",
    "INAV: geozone with the action RTH": f"{_SITL}::test_it_returns_from_a_zone_with_that_action",
    "INAV: nav_wp_radius": "source: navigation/navigation.c, isWaypointReached",
    "INAV: nav_rth_altitude, nav_rth_alt_mode": "source: navigation/navigation.c, updateDesiredRTHAltitude",
    "INAV: return to a safehome": "source: navigation/navigation.c, findNearestSafeHome",
    "INAV: landing of an aeroplane by an FW approach": "source: fc/fc_msp.c, 7.1.0 to 9.1.0",
    "INAV: aeroplane, rover and boat": "source: the lines in the second table of docs/inav.md",
}


def flights() -> str:
    """What confirms each rule about the flight."""
    rows = ""
    for rule, by in FLIGHTS.items():
        file, _, name = by.partition("::")
        rows += f"| {rule} | {f'`{name}` in `{file}`' if name else by} |\n"
    return f"| rule at Write | confirmed by |\n|---|---|\n{rows}"


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
    sys.stdout.write(flights() if sys.argv[1:] == ["flights"] else table())
