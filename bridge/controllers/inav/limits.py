# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings and the platform of an INAV decide whether it arms with a mission, and how it flies it (docs/inav.md).

Flown by tests/real_inav. Sources: navigationIsBlockingArming, updateClimbRateToAltitudeController,
updateDesiredRTHAltitude, navigationRTHAllowsLanding and findNearestSafeHome (navigation.c of 6.1.1 to 9.1.0).
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from enum import Enum, IntEnum
from typing import Any

from bridge.controllers.inav.zone_check import judge_zones
from bridge.controllers.nav.flown_path import above_home_cm
from bridge.missions.flown_legs import Departure, FlownPath, Judgement, beyond_plain_limits, first_of, in_metres
from bridge.model.craft import Airframe
from bridge.model.ground_track import Place, distance_m
from protocols.msp.inav_places import FwApproach, Geozone, Safehome
from protocols.msp.nav import FLY_HOME, LEGS, TURNS, NavAction, NavRecord
from protocols.msp.nav_items import leg_speed
from protocols.plain_text import shown
from protocols.settings_file import SavedSettings
from reports.finding import News


class Platform(Enum):
    """The platforms whose missions differ, by the words for them."""

    MULTIROTOR = "a multirotor"
    AEROPLANE = "an aeroplane"
    ROVER = "a rover"
    BOAT = "a boat"


class MissionPart(Enum):
    """The name in the table of docs/inav.md, and the field of the item that a message names."""

    SPEED = "speed of a leg", "command"
    HEIGHT = "height of a leg", "alt_m"
    HOLD = "LOITER_TIME, LOITER_UNLIM", "command"
    TURN = "CONDITION_YAW, ROI", "command"
    LANDING = "LAND, RTL that lands", "command"


_NO_SPEED = "speed ignored on {}", News.WARNING
_NO_TURN = "no effect on {}", News.WARNING
_ON_THE_GROUND = {
    MissionPart.SPEED: _NO_SPEED,
    MissionPart.HEIGHT: ("Alt ignored on {}", News.NOTICE),
    MissionPart.HOLD: ("{} drives on while it holds", News.WARNING),
    MissionPart.TURN: _NO_TURN,
    MissionPart.LANDING: ("{} disarms there", News.NOTICE),
}
#: What a platform ignores or flies otherwise than a multirotor, in a message's words (sources: docs/inav.md).
FLOWN_OTHERWISE: Mapping[Platform, Mapping[MissionPart, tuple[str, News]]] = {
    Platform.MULTIROTOR: {},
    Platform.AEROPLANE: {
        MissionPart.SPEED: _NO_SPEED,
        MissionPart.HOLD: ("{} circles there", News.NOTICE),
        MissionPart.TURN: _NO_TURN,
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


class RthAltMode(IntEnum):
    """nav_rth_alt_mode. The last only in version 6."""

    CURRENT = 0
    EXTRA = 1
    FIXED = 2
    MAX = 3
    AT_LEAST = 4
    AT_LEAST_LINEAR_DESCENT = 5


class SafehomeUsageMode(IntEnum):
    """safehome_usage_mode."""

    OFF = 0
    RTH = 1
    RTH_FS = 2


@dataclass(frozen=True, slots=True)
class InavLimits:
    """Fields with a name of INAV's are settings, in INAV's units: cm, but the first in m.

    Their defaults are INAV's; 0 turns the first, nav_max_altitude and nav_wp_enforce_altitude off.
    zones: those in force; none without the feature GEOZONE. selected: the mission that was selected, from 1, if there
    are several. approach: an aeroplane's to the LAND of the new list, or None before 7.1. unknown: settings whose
    default is assumed.
    """

    nav_wp_max_safe_distance: int = 100
    nav_wp_radius: int = 100
    nav_wp_enforce_altitude: int = 0
    nav_max_auto_speed: int = 1000
    nav_max_altitude: int = 0
    nav_rth_altitude: int = 1000
    nav_rth_alt_mode: int = RthAltMode.AT_LEAST
    safehome_usage_mode: int = SafehomeUsageMode.RTH
    safehome_max_distance: int = 20000
    geozone_mr_stop_distance: int = 15000
    safehomes: tuple[Safehome, ...] = ()
    zones: tuple[Geozone, ...] = ()
    selected: int = 1
    version: tuple[int, int, int] = (9, 1, 0)
    platform: Platform = Platform.MULTIROTOR
    approach: FwApproach | None = None
    unknown: tuple[str, ...] = ("nav_wp_max_safe_distance", "nav_max_altitude", "nav_rth_altitude")

    def with_settings(self, values: Mapping[str, float | str]) -> "InavLimits":
        """With these settings. Raises ValueError for a value that is not a number or a choice."""
        given = {name: _number(name, values[name]) for name in SETTING_NAMES if name in values}
        return replace(self, **given, unknown=tuple(name for name in self.unknown if name not in values))

    def assumed(self) -> Sequence[str]:
        return [f"{name} = {getattr(self, name)}" for name in self.unknown]

    def return_cm(self, _rth: NavRecord, here_cm: int | None, highest_cm: int) -> int | None:
        if self.nav_rth_alt_mode == RthAltMode.FIXED:
            return self.nav_rth_altitude
        if here_cm is None:
            return None
        match self.nav_rth_alt_mode:
            case RthAltMode.CURRENT:
                return here_cm
            case RthAltMode.EXTRA:
                return here_cm + self.nav_rth_altitude
            case RthAltMode.MAX:
                return max(highest_cm, self.nav_rth_altitude)
        return max(here_cm, self.nav_rth_altitude)

    def judge(self, records: Sequence[NavRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        """Rejects a list only if INAV would not arm, or would not fly it as it is shown."""
        yield from self._first(records[0], departure)
        yield from self._heights(records, departure)
        for leg in path.legs:
            if leg.is_return:
                yield from self._return(leg.target, records[leg.target], path.highest_cm, departure)
            if records[leg.target].action == NavAction.LAND and self.platform is Platform.AEROPLANE:
                yield _landing(leg.target, self.approach)
        short_m = self.nav_wp_radius / 100
        close = [leg for leg in path.legs if leg.length_m < short_m and not (leg.is_first or leg.is_return)]
        within = f"within nav_wp_radius ({short_m:g} m): it may count as reached at once"
        whys = [(leg.cause, f"{leg.length_m:.1f} m from the waypoint before, {within}") for leg in close]
        yield from first_of(whys, "lat_e7", News.NOTICE)
        for part, (why, news) in FLOWN_OTHERWISE[self.platform].items():
            cases = [place for place, record in enumerate(records) if part in _parts(record)]
            yield from first_of([(place, why.format(self.platform.value)) for place in cases], part.value[1], news)
        if self.platform is Platform.MULTIROTOR:
            yield from self._speeds(records)
        yield from judge_zones(self.zones, path, departure, self.geozone_mr_stop_distance / 100)
        yield from beyond_plain_limits(path, departure, height=not self.nav_max_altitude)
        if self.selected > 1:
            has_approaches = self.platform is Platform.AEROPLANE and self.approach is not None
            lands = ": each mission lands by the FW approach with the new number" * has_approaches
            why = f"Stored as mission 1, mission {self.selected} was selected{lands}"
            yield Judgement(None, "", why, News.WARNING if has_approaches else News.NOTICE)

    def _first(self, first: NavRecord, departure: Departure) -> Iterable[Judgement]:
        """INAV measures the distance to the first record, whatever the action, from where it is armed."""
        limit_m = self.nav_wp_max_safe_distance
        if not limit_m or first.flag == FLY_HOME or not (first.lat_e7 or first.lon_e7) or departure.place is None:
            return
        if (metres := distance_m(departure.place, first)) <= limit_m:
            return
        if departure.home is not None and distance_m(departure.home, first) <= limit_m:
            off = in_metres(distance_m(departure.place, departure.home))
            yield Judgement(0, "lat_e7", f"arms only near the list's home, {off} off")
            return
        limit = f"nav_wp_max_safe_distance is {limit_m} m"
        yield Judgement(0, "lat_e7", f"{in_metres(metres)} from {departure.name}, {limit}: INAV would not arm", None)

    def _heights(self, records: Sequence[NavRecord], departure: Departure) -> Iterable[Judgement]:
        limit_cm = self.nav_max_altitude
        if not limit_cm or self.nav_wp_enforce_altitude:
            return
        unknown, higher = [], []
        for place, record in enumerate(records):
            if record.action not in LEGS:
                continue
            height_cm = above_home_cm(record, departure)
            if height_cm is None:
                unknown.append((place, "too high? home's Alt is unknown"))
            elif height_cm > limit_cm and self.version < _LIMITS_MISSIONS:
                higher.append((place, f"{height_cm / 100:g} m, over nav_max_altitude {limit_cm / 100:g} m"))
            elif height_cm > limit_cm:
                why = f"nav_max_altitude is {limit_cm / 100:g} m: INAV would not climb to {height_cm / 100:g} m"
                yield Judgement(place, "alt_m", why, None)
        yield from first_of(unknown, "alt_m")
        yield from first_of(higher, "alt_m")

    def _speeds(self, records: Sequence[NavRecord]) -> Iterable[Judgement]:
        speeds = [(place, leg_speed(record, 0)) for place, record in enumerate(records) if record.action in LEGS]
        limit = self.nav_max_auto_speed
        fast = [(place, speed) for place, speed in speeds if speed > limit]
        whys = [(place, f"{speed / 100:g} m/s, nav_max_auto_speed is {limit / 100:g} m/s") for place, speed in fast]
        yield from first_of(whys, "command", News.WARNING)

    def _return(self, place: int, rth: NavRecord, highest_cm: int, departure: Departure) -> Iterable[Judgement]:
        if self.nav_rth_alt_mode == RthAltMode.FIXED and self.nav_rth_altitude < highest_cm:
            why = f"RTH at nav_rth_altitude {self.nav_rth_altitude / 100:g} m, below {highest_cm / 100:g} m"
            yield Judgement(place, "alt_m", why)
        if (start := departure.place) is not None:
            near = self._near_safehome(start)
            if near and self.safehome_usage_mode == SafehomeUsageMode.RTH:
                limit = f"safehome_max_distance is {self.safehome_max_distance / 100:g} m"
                metres = distance_m(start, near)
                why = f"returns to safehome {near.number}, {metres:.0f} m from home ({limit})"
                yield Judgement(place, "p1", why, News.WARNING)
            if rth.p1 and self.platform is Platform.AEROPLANE:
                # INAV lands by the approach of the nearest safehome, and there, even if it returns to home.
                yield _landing(place, near.approach if near else None)

    def _near_safehome(self, start: Place) -> Safehome | None:
        """The one that INAV chooses where it is armed."""
        limit_m = self.safehome_max_distance / 100
        near = [each for each in self.safehomes if each.enabled and distance_m(start, each) <= limit_m]
        return min(near, key=lambda each: distance_m(start, each), default=None)


def _landing(place: int, approach: FwApproach | None) -> Judgement:
    if approach and (headings := approach.directions()):
        why = f"lands by FW approach {approach.number}: heading {' or '.join(map(str, headings))}"
        return Judgement(place, "command", why, News.NOTICE)
    why = "circles down and lands in any direction: no FW approach"
    return Judgement(place, "command", why, News.WARNING)


#: The first version whose missions do not climb above nav_max_altitude.
_LIMITS_MISSIONS = 8, 0, 0
_CHOICES: Mapping[str, type[IntEnum]] = {
    "nav_rth_alt_mode": RthAltMode,
    "safehome_usage_mode": SafehomeUsageMode,
}
_OTHER_FIELDS = ("safehomes", "zones", "selected", "version", "platform", "approach", "unknown")
#: Those that decide if a list is flown, and how high and fast.
DECISIVE_NAMES = (
    *("nav_wp_max_safe_distance", "nav_max_altitude", "nav_wp_enforce_altitude"),
    *("nav_max_auto_speed", "nav_rth_altitude", "nav_rth_alt_mode"),
)
SETTING_NAMES = tuple(field.name for field in fields(InavLimits) if field.name not in _OTHER_FIELDS)


def saved_limits(saved: SavedSettings | None) -> InavLimits:
    """The settings in a file. Those that it lacks, as `diff all` does, have INAV's defaults. ValueError."""
    return InavLimits() if saved is None else InavLimits(safehomes=saved.safehomes).with_settings(saved.values)


def _number(name: str, value: float | str) -> Any:
    if name in _CHOICES and isinstance(value, str) and value in _CHOICES[name].__members__:
        return _CHOICES[name][value]
    try:
        return int(float(value))
    except (ValueError, OverflowError):
        raise ValueError(f"{name} cannot be {shown(value)}") from None


def readable(values: Mapping[str, float | str]) -> dict[str, float | str]:
    """Those of a board's values that are numbers or choices."""
    found = {}
    for name, value in values.items():
        with suppress(ValueError):
            if name in SETTING_NAMES:
                _number(name, value)
            found[name] = value
    return found
