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

_CHECK = "tests/bridge/controllers/harakiri/test_flight.py"
_CORE, _BOARD = "firmware/tests/test_flight.c", "tests/real_board/test_real_missions.py"
_ARMING, _LIMITS = "tests/real_inav/test_arming.py", "tests/real_inav/test_limits.py"
_ZONES, _ROWS = "tests/real_inav/test_zones.py", "tests/real_inav/test_flights.py"
#: Each rule about the flight, and the test that confirms it by a flight, or a place in INAV 9.1.0 (src/main).
FLIGHTS = {
    "Harakiri: first place, leg, height, from the craft or the list's home": (
        f"{_CHECK}::test_the_core_refuses_exactly_the_reported_lists"
    ),
    "Harakiri: mission_radius, and random lists": f"{_CHECK}::test_exactly_the_refusals_of_the_core_are_reported",
    "Harakiri: public missions": f"{_CHECK}::test_every_refusal_of_a_public_mission_is_reported",
    "Harakiri: TAKEOFF only first, LAND only last, no ROI last, only the commands of the table": (
        f"{_CORE}::test_refusals"
    ),
    "Harakiri: holds, turns, radii, the place and height of RETURN_TO_LAUNCH": f"{_CORE}::check_leave",
    "Harakiri: heights on the way, fly through or brake, the nose on a ROI, LAND where it is": f"{_CORE}::check_step",
    "Harakiri: whole lists on the emulated board": f"{_BOARD}::test_a_mission_is_flown",
    "INAV: first place too far, also of a ROI, after jumps": (
        f"{_ARMING}::test_it_arms_exactly_with_the_lists_that_the_rules_accept"
    ),
    "INAV: nav_wp_max_safe_distance": (f"{_ARMING}::test_a_distant_first_place_arms_within_nav_wp_max_safe_distance"),
    "INAV: arming in and outside of geozones": f"{_ARMING}::test_it_arms_exactly_in_the_zones_that_the_rules_accept",
    "INAV: LOITER_UNLIM as a hold, 120 records": (f"{_ARMING}::test_it_stores_exactly_the_records_of_the_rules"),
    "INAV: each row of the first table of docs/inav.md": f"{_ROWS}::test_each_row_is_flown_as_documented",
    "INAV: TAKEOFF is not needed": f"{_LIMITS}::test_it_takes_off_without_a_takeoff_record_at_low_throttle",
    "INAV: nav_max_altitude, nav_wp_enforce_altitude": (
        f"{_LIMITS}::test_a_list_above_nav_max_altitude_is_refused_where_it_would_fly_lower"
    ),
    "INAV: heights above sea level": f"{_LIMITS}::test_a_height_counts_from_the_reported_level",
    "INAV: nav_max_auto_speed, speed of a leg": f"{_LIMITS}::test_a_leg_is_flown_at_the_reported_speed",
    "INAV: nav_wp_radius": f"{_LIMITS}::test_a_leg_within_nav_wp_radius_counts_as_reached_at_once",
    "INAV: nav_rth_altitude, nav_rth_alt_mode": f"{_LIMITS}::test_a_return_flies_at_the_reported_height",
    "INAV: CONDITION_YAW, ROI": f"{_LIMITS}::test_the_nose_turns_as_the_record_says",
    "INAV: return to a safehome": f"{_LIMITS}::test_a_return_goes_to_the_reported_safehome",
    "INAV: RTL that lands, or not": f"{_LIMITS}::test_the_last_record_decides_if_a_return_lands",
    "INAV: geozone on the way or after a jump, with heights, without an action": (
        f"{_ZONES}::test_a_mission_stops_at_a_zone_as_reported"
    ),
    "INAV: geozone with the action RTH": f"{_ZONES}::test_it_returns_from_a_zone_with_that_action",
    "INAV: landing of an aeroplane by an FW approach": "source: navigation/navigation.c:1848, fwAutolandApproachConfig",
    "INAV: aeroplane, rover and boat": "source: the lines in the second table of docs/inav.md",
}
_ONE_WAY = "flown only as the rule says"
_NOT_FLOWN = "not flown, from INAV's source"
#: Rules without flights of the opposite: these say how an item is flown, or that a board needs nothing.
_AS_SHOWN = (
    "Harakiri: holds, turns, radii, the place and height of RETURN_TO_LAUNCH",
    "Harakiri: heights on the way, fly through or brake, the nose on a ROI, LAND where it is",
    "Harakiri: whole lists on the emulated board",
    "INAV: each row of the first table of docs/inav.md",
    "INAV: TAKEOFF is not needed",
    "INAV: heights above sea level",
)


def flights() -> str:
    """The rules about the flight that were not flown both ways."""
    by_ways: dict[str, list[str]] = {}
    for rule, by in FLIGHTS.items():
        if "::" not in by or rule in _AS_SHOWN:
            by_ways.setdefault(_ONE_WAY if "::" in by else _NOT_FLOWN, []).append(f"  - {rule}\n")
    return "".join(f"- {ways}:\n{''.join(rules)}" for ways, rules in by_ways.items())


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
