# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists for INAV and MultiWii NAV, and what their rules keep of them."""

from dataclasses import replace
from typing import Any

from bridge.controllers.multiwii import multiwii_profile
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.mission_item import Command, MissionItem
from protocols.msp.nav import NavAction, NavRecord
from reports.verdict import Result, Verdict

INAV, MULTIWII = NavRules(NavProfile()), NavRules(multiwii_profile())
LAT, LON = 453838000, 84733000
A = NavAction
C = Command


def item(command: int, *, at: bool = True, **fields: Any) -> MissionItem:
    place = (LAT, LON, 50.0) if at else (0, 0, 0.0)
    return replace(MissionItem(0, command, 3, 0.0, 0.0, 0.0, 0.0, *place), **fields)


HOME = item(C.NAV_WAYPOINT, frame=0, alt_m=123.0)
WP = item(C.NAV_WAYPOINT)
RTL, RTL_LANDS = (item(C.NAV_RETURN_TO_LAUNCH, at=False, p1=p1) for p1 in (0.0, 1.0))


def verdict_on(*items: MissionItem, rules: NavRules = INAV) -> Verdict[NavRecord]:
    return check_list((HOME, *items), rules)


def kept(*items: MissionItem, rules: NavRules = INAV) -> tuple[NavRecord, ...]:
    verdict = verdict_on(*items, rules=rules)
    assert verdict.result is Result.ACCEPTED, verdict.findings
    return verdict.records


def findings_for(*items: MissionItem, rules: NavRules = INAV) -> list[tuple[Any, ...]]:
    return [(f.seq, f.field, f.was, f.becomes) for f in verdict_on(*items, rules=rules).findings]


def jump(target: float, repeats: float = 2) -> MissionItem:
    return item(C.DO_JUMP, at=False, p1=float(target), p2=float(repeats))


def speed(metres: float, kind: float = 1, throttle: float = 0) -> MissionItem:
    return item(C.DO_CHANGE_SPEED, at=False, p1=kind, p2=metres, p3=throttle)
