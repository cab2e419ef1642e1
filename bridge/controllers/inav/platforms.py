# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a mission that an INAV flies differently, or ignores, by its platform: the second table of docs/inav.md.

Sources are lines of INAV 9.1.0 (src/main), or the flights of tests/real_inav/test_sitl.py.
"""

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from bridge.missions.flown_legs import Judgement, first_of
from bridge.model.craft import Airframe
from protocols.msp.nav import LEGS, TURNS, NavAction, NavRecord
from protocols.msp.nav_items import leg_speed
from reports.finding import News


class Platform(Enum):
    """The platforms whose missions differ, by the words for them."""

    MULTIROTOR = "a multirotor"
    AEROPLANE = "an aeroplane"
    ROVER = "a rover"
    BOAT = "a boat"


class MissionPart(Enum):
    """its name in the table, and the field of the item that a message names."""

    SPEED = "speed of a leg", "command"
    HEIGHT = "height of a leg", "alt_m"
    HOLD = "LOITER_TIME, LOITER_UNLIM", "command"
    TURN = "CONDITION_YAW, ROI", "command"
    LANDING = "LAND, RTL that lands", "command"


class PlatformEffect(NamedTuple):
    """How it is flown, in a message's words; empty: as sent. source: where that is known from."""

    why: str
    source: str
    news: News = News.WARNING


_ON_THE_GROUND = {
    MissionPart.SPEED: PlatformEffect("its speed: no effect on {}", "navigation_rover_boat.c:130: cruise throttle"),
    MissionPart.HEIGHT: PlatformEffect("Alt: no effect on {}", "flight/mixer.c:171: no altitude control", News.NOTICE),
    MissionPart.HOLD: PlatformEffect("{} drives on while it holds", "navigation_rover_boat.c:119: stops at the end"),
    MissionPart.TURN: PlatformEffect("no effect on {}", "navigation.c:1998 and 2006: multirotors only"),
    MissionPart.LANDING: PlatformEffect("{} disarms there", "navigation.c:1896", News.NOTICE),
}
PLATFORMS: Mapping[Platform, Mapping[MissionPart, PlatformEffect]] = {
    Platform.MULTIROTOR: {
        MissionPart.SPEED: PlatformEffect("", "up to nav_max_auto_speed: flown"),
        MissionPart.HEIGHT: PlatformEffect("", "flown"),
        MissionPart.HOLD: PlatformEffect("", "navigation.c:2106"),
        MissionPart.TURN: PlatformEffect("", "navigation.c:2050"),
        MissionPart.LANDING: PlatformEffect("", "flown"),
    },
    Platform.AEROPLANE: {
        MissionPart.SPEED: PlatformEffect("its speed: no effect on {}", "navigation_multicopter.c:734 only"),
        MissionPart.HEIGHT: PlatformEffect("", "navigation_fixedwing.c:136"),
        MissionPart.HOLD: PlatformEffect("{} circles there", "navigation_fixedwing.c:324", News.NOTICE),
        MissionPart.TURN: PlatformEffect("no effect on {}", "navigation.c:1998 and 2006: multirotors only"),
        MissionPart.LANDING: PlatformEffect("", "by its FW approach, see below"),
    },
    Platform.ROVER: _ON_THE_GROUND,
    Platform.BOAT: _ON_THE_GROUND,
}
_BY_AIRFRAME = {
    Airframe.FIXED_WING: Platform.AEROPLANE,
    Airframe.ROVER: Platform.ROVER,
    Airframe.BOAT: Platform.BOAT,
}


def platform_of(airframe: Airframe | None) -> Platform:
    return Platform.MULTIROTOR if airframe is None else _BY_AIRFRAME.get(airframe, Platform.MULTIROTOR)


def flown_otherwise(records: Sequence[NavRecord], platform: Platform) -> Iterable[Judgement]:
    """One judgement about each part that this platform ignores or flies differently."""
    for part, effect in PLATFORMS[platform].items():
        if effect.why:
            why = effect.why.format(platform.value)
            cases = [(place, why) for place, record in enumerate(records) if part in _parts(record)]
            yield from first_of(cases, part.value[1], effect.news)


def _parts(record: NavRecord) -> Iterable[MissionPart]:
    if record.action in LEGS:
        yield MissionPart.HEIGHT
        if leg_speed(record, 0):
            yield MissionPart.SPEED
    if record.action == NavAction.POSHOLD_TIME:
        yield MissionPart.HOLD
    if record.action in TURNS and record.p1 >= 0:
        yield MissionPart.TURN
    if record.action == NavAction.LAND or (record.action == NavAction.RTH and record.p1):
        yield MissionPart.LANDING
