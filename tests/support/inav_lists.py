# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists for INAV's own SITL, and what the bridge says about them at Write."""

from collections.abc import Sequence
from dataclasses import replace

from bridge.controllers.inav.limits import InavLimits
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import NavProfile
from bridge.missions.list_check import check_list
from protocols.msp.inav_places import Corner, FenceAction, Geozone
from protocols.msp.nav import LAST, NavAction, NavRecord
from protocols.msp.nav_items import home_item, items_from_records
from reports.verdict import Result, Verdict
from tests.support.inav_sitl import LAT_E7, LON_E7

_E7_PER_M, _E7_PER_M_EAST = 89.93, 128.04


def place(north_m: float, east_m: float = 0) -> tuple[int, int]:
    return LAT_E7 + round(north_m * _E7_PER_M), LON_E7 + round(east_m * _E7_PER_M_EAST)


def leg(
    north_m: float, height_m: float = 15, east_m: float = 0, action: NavAction = NavAction.WAYPOINT, **fields: int
) -> NavRecord:
    return NavRecord(action, *place(north_m, east_m), round(height_m * 100), **fields)


def jump(target: int, repeats: int = 1) -> NavRecord:
    return NavRecord(NavAction.JUMP, p1=target, p2=repeats)


def rth(*, lands: bool = False) -> NavRecord:
    return NavRecord(NavAction.RTH, p1=int(lands))


def circle(north_m: float, radius_m: int, action: FenceAction, **fields: int) -> Geozone:
    return Geozone(0, bool(fields.pop("is_inclusive", False)), (Corner(*place(north_m)),), radius_m * 100,
                   action=action, **fields)  # type: ignore[arg-type]  # fmt: skip


def ended(records: Sequence[NavRecord]) -> list[NavRecord]:
    return [*records[:-1], replace(records[-1], flag=LAST)]


def verdict(records: Sequence[NavRecord], **limits: object) -> Verdict[NavRecord]:
    """For a craft on the field."""
    items = items_from_records(ended(records), home_item((LAT_E7, LON_E7), 131.0))
    rules = NavRules(NavProfile(limits=InavLimits(**limits)))  # type: ignore[arg-type]
    return check_list(items, rules, (LAT_E7, LON_E7))


def said(records: Sequence[NavRecord], **limits: object) -> str:
    """All messages, and the flight in words."""
    told = verdict(records, **limits)
    return " / ".join([*(finding.text() for finding in told.findings), *told.flight])


def is_refused(records: Sequence[NavRecord], **limits: object) -> bool:
    return verdict(records, **limits).result is Result.REJECTED
