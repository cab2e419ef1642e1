# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of docs/inav.md: the records of each command on INAV and MultiWii, and how the board flies them.

`make inav-page` writes it into the page. Records and findings come from the rules; the flights are written here, and
test_nav_flights compares them with the simulated board.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from bridge.controllers.inav.limits import FLOWN_OTHERWISE, MissionPart, Platform
from bridge.controllers.multiwii import multiwii_profile
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import Command, MissionItem
from protocols.msp.nav import NavAction, NavRecord
from reports.finding import News
from reports.verdict import Result, Verdict

RULES = {"inav": NavRules(NavProfile()), "multiwii": NavRules(multiwii_profile())}
LAT, LON = 453838000, 84733000
#: About 20 m to the north.
STEP = 1800


def leg(place: int, command: int = Command.NAV_WAYPOINT, **fields: float) -> MissionItem:
    """An item at 20 m height, each index 20 m further north."""
    at = MissionItem(0, command, 3, 0, 0, 0, 0, LAT + place * STEP, LON, 20.0)
    return replace(at, **fields)  # type: ignore[arg-type]


def act(command: int, p1: float = 0, p2: float = 0, p4: float = 0) -> MissionItem:
    """An item without a position."""
    return MissionItem(0, command, 3, float(p1), float(p2), 0, float(p4), 0, 0, 0.0)


HOME = MissionItem(0, Command.NAV_WAYPOINT, 0, 0, 0, 0, 0, LAT, LON, 131.0)
ONE, TWO, THREE = leg(1), leg(2), leg(3)


@dataclass(frozen=True)
class Row:
    """`name` as a pilot reads it. `items` without home. `inav`, `multiwii`: the flight, "" if rejected.

    A flight is the records flown to, each with its effects, and how it ends.
    """

    name: str
    items: Sequence[MissionItem]
    inav: str
    multiwii: str

    def verdict(self, kind: str) -> Verdict[NavRecord]:
        return check_list((HOME, *self.items), RULES[kind])


ROWS = (
    Row("WAYPOINT", (ONE, TWO), "1 2 hovers", "1 2 hovers"),
    Row("WAYPOINT, Delay 7", (replace(ONE, p1=7), TWO), "1 (7 s) 2 hovers", "1 (7 s) 2 hovers"),
    Row("WAYPOINT, Delay 70", (replace(ONE, p1=70), TWO), "1 (70 s) 2 hovers", "1 (65 s) 2 hovers"),
    Row("WAYPOINT at 0 m", (ONE, leg(4, alt_m=0.0)), "1 2 hovers at 2 m", "1 2 hovers at 2 m"),
    Row("WAYPOINT at -5 m", (ONE, leg(4, alt_m=-5.0)), "1 2 hovers at -5 m", "1 2 hovers at -5 m"),
    Row("WAYPOINT at 150 m", (ONE, leg(20, alt_m=150.0)), "1 2 hovers at 150 m", "1 2 hovers at 100 m"),
    Row("WAYPOINT 600 m away", (ONE, leg(31)), "1 2 hovers", "1 stops"),
    Row("WAYPOINT above sea level", (leg(1, frame=0, alt_m=151.0), TWO), "1 2 hovers", "1 2 hovers"),
    Row("LOITER_UNLIM", (ONE, leg(2, Command.NAV_LOITER_UNLIM)), "1 2 (stays)", "1 2 hovers"),
    Row("LOITER_TURNS", (ONE, leg(2, Command.NAV_LOITER_TURNS, p1=3)), "1 2 hovers", "1 2 hovers"),
    Row("LOITER_TIME 9 s", (leg(1, Command.NAV_LOITER_TIME, p1=9), TWO), "1 (9 s) 2 hovers", "1 (9 s) 2 hovers"),
    Row("RETURN_TO_LAUNCH", (ONE, act(Command.NAV_RETURN_TO_LAUNCH)), "1 2 hovers at home", "1 2 hovers at home"),
    Row(
        "RETURN_TO_LAUNCH, param1 1",
        (ONE, act(Command.NAV_RETURN_TO_LAUNCH, 1)),
        "1 2 lands at home",
        "1 2 lands at home",
    ),
    Row(
        "RETURN_TO_LAUNCH, not last",
        (ONE, act(Command.NAV_RETURN_TO_LAUNCH), act(Command.DO_CHANGE_SPEED, 1, 5), THREE),
        "1 2 hovers at home",
        "1 2 hovers at home",
    ),
    Row(
        "RETURN_TO_LAUNCH skipped by a jump",
        (ONE, act(Command.DO_JUMP, 5, 1), TWO, act(Command.NAV_RETURN_TO_LAUNCH, 1), THREE, leg(4)),
        "",
        "",
    ),
    Row("LAND", (ONE, leg(2, Command.NAV_LAND)), "1 2 lands", "1 2 lands"),
    Row("LAND at 0 m", (ONE, leg(2, Command.NAV_LAND, alt_m=0.0)), "1 2 lands", "1 2 lands"),
    Row("LAND without a position", (ONE, act(Command.NAV_LAND)), "1 2 lands", "1 2 lands"),
    Row("TAKEOFF", (act(Command.NAV_TAKEOFF), ONE, TWO), "1 2 hovers", "1 2 hovers"),
    Row("ROI", (ONE, leg(4, Command.NAV_ROI), TWO), "1 3 hovers", "1 3 hovers"),
    Row("DO_SET_ROI", (ONE, leg(4, Command.DO_SET_ROI), TWO), "1 3 hovers", "1 3 hovers"),
    Row("DO_SET_ROI_LOCATION", (ONE, leg(4, Command.DO_SET_ROI_LOCATION), TWO), "1 3 hovers", "1 3 hovers"),
    Row(
        "ROI on the next leg",
        (ONE, leg(3, Command.NAV_ROI), leg(5), leg(7)),
        "1 3 4 hovers",
        "1 3 4 hovers short of it",
    ),
    Row("DO_SET_ROI_LOCATION, last", (ONE, TWO, leg(4, Command.DO_SET_ROI_LOCATION)), "1 2 hovers", "1 2 hovers"),
    Row("DO_SET_ROI_NONE", (ONE, act(Command.DO_SET_ROI_NONE), TWO), "1 3 hovers", "1 3 hovers"),
    Row("DO_SET_ROI_NONE, last", (ONE, TWO, act(Command.DO_SET_ROI_NONE)), "1 2 hovers", "1 2 hovers"),
    Row("CONDITION_YAW -90", (ONE, act(Command.CONDITION_YAW, -90), TWO), "1 3 hovers", "1 3 hovers"),
    Row("CONDITION_YAW, relative", (ONE, act(Command.CONDITION_YAW, 20, p4=1), TWO), "1 2 hovers", "1 2 hovers"),
    Row("CONDITION_YAW, last", (ONE, TWO, act(Command.CONDITION_YAW, 90)), "1 2 hovers", "1 2 hovers"),
    Row(
        "DO_JUMP back, once", (ONE, TWO, THREE, act(Command.DO_JUMP, 1, 1)), "1 2 3 1 2 3 hovers", "1 2 3 1 2 3 hovers"
    ),
    Row("DO_JUMP back, for ever", (ONE, TWO, act(Command.DO_JUMP, 1, -1)), "never ends", "never ends"),
    Row("DO_JUMP back, Repeat# -5", (ONE, TWO, act(Command.DO_JUMP, 1, -5)), "never ends", "never ends"),
    Row("DO_JUMP forward", (ONE, act(Command.DO_JUMP, 4, 1), TWO, THREE), "1 4 hovers", ""),
    Row(
        "DO_JUMP within another's loop",
        (ONE, TWO, THREE, act(Command.DO_JUMP, 1, 1), leg(4), act(Command.DO_JUMP, 3, 1), leg(5)),
        "1 2 3 1 2 3 5 3 1 2 3 5 7 hovers",
        "",
    ),
    Row(
        "DO_CHANGE_SPEED 5 m/s", (ONE, act(Command.DO_CHANGE_SPEED, 1, 5), leg(11)), "1 2 (5 m/s) hovers", "1 2 hovers"
    ),
    Row("DO_CHANGE_SPEED 0", (ONE, act(Command.DO_CHANGE_SPEED, 1, 0), leg(11)), "1 2 hovers", "1 2 hovers"),
    Row(
        "DO_CHANGE_SPEED, then a DO_JUMP to before it",
        (leg(4), leg(1), act(Command.DO_CHANGE_SPEED, 1, 5), leg(9), act(Command.DO_JUMP, 1, 1), leg(1)),
        "1 2 3 (5 m/s) 1 2 3 (5 m/s) 5 (5 m/s) hovers",
        "1 2 3 1 2 3 5 hovers",
    ),
    Row("anything else", (ONE, act(Command.DO_SET_ROI_NONE + 9), TWO), "1 2 hovers", "1 2 hovers"),
)


def table() -> str:
    """A row for each command, or for neighbours that are treated alike."""
    lines = ["| sent | records and messages | flown |", "|---|---|---|"]
    for cells, rows in groupby(ROWS, _cells):
        lines.append(f"| {' | '.join((', '.join(row.name for row in rows), *cells))} |")
    return "\n".join(lines) + "\n\n" + platform_table()


#: Where the platforms' effects are known from: a flight of tests/real_inav, or a line of INAV 9.1.0 (src/main).
_TURN = "navigation.c:1998 and 2006: multirotors only"
_GROUND = (
    "navigation_rover_boat.c:130: cruise throttle",
    "flight/mixer.c:171: no altitude control",
    "navigation_rover_boat.c:119: stops at the end",
    _TURN,
    "navigation.c:1896",
)
SOURCES = {
    Platform.MULTIROTOR: ("up to nav_max_auto_speed: flown", "flown", "flown", "flown", "flown"),
    Platform.AEROPLANE: (
        "getActiveSpeed is read in navigation_multicopter.c only",
        "navigation_fixedwing.c:132",
        "navigation_fixedwing.c:335",
        _TURN,
        "by its FW approach, see below",
    ),
    Platform.ROVER: _GROUND,
}


def platform_table() -> str:
    """How each platform of INAV flies the parts of a mission, and where that is known from."""
    lines = ["| on INAV | multirotor | aeroplane | rover, boat |", "|---|---|---|---|"]
    for row, part in enumerate(MissionPart):
        cells = []
        for platform, sources in SOURCES.items():
            why, _ = FLOWN_OTHERWISE[platform].get(part, ("as sent", None))
            cells.append(f"{why.format(platform.value)} ({sources[row]})")
        lines.append(f"| {part.value[0]} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cells(row: Row) -> tuple[str, str]:
    inav, multiwii = _parts(row.verdict("inav")), _parts(row.verdict("multiwii"))
    records = "; ".join(inav)
    if inav != multiwii:
        more = [part for part in multiwii if part not in inav]
        records += "<br>MultiWii" + (
            " also: " + "; ".join(more) if {*inav} < {*multiwii} else ": " + "; ".join(multiwii)
        )
    flown, flown_by_multiwii = row.inav or "rejected", row.multiwii or "rejected"
    return records, flown if flown == flown_by_multiwii else f"{flown}<br>MultiWii: {flown_by_multiwii}"


def _parts(verdict: Verdict[NavRecord]) -> list[str]:
    """The records, unless the list is rejected, and each message."""
    texts = [f"{'**' * (f.is_warning)}{f.text()}{'**' * (f.is_warning)}"
            for f in verdict.findings if f.news is not News.NONE]  # fmt: skip
    if verdict.result is not Result.ACCEPTED:
        return texts
    return [", ".join(_record(record) for record in verdict.records), *texts]


def _record(record: NavRecord) -> str:
    values = [f"p{n} {value}" for n, value in ((1, record.p1), (2, record.p2), (3, record.p3)) if value]
    return " ".join([NavAction(record.action).name, *values])


if __name__ == "__main__":
    sys.stdout.write(table())
