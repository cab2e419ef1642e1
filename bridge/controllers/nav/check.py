# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for a mission list on INAV and MultiWii NAV (docs/inav.md)."""

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

from bridge.controllers.nav.flown_path import flown_size, fly, jump_within_jump, lands_after_rth
from bridge.controllers.nav.rules import (
    HOLD,
    LANDS,
    LEAST_HEIGHT_M,
    NAV_RULES,
    REPEATS,
    AltitudeUse,
    Jumps,
    LegSpeed,
    Mission,
    NavProfile,
    NavRule,
    placed_landing,
)
from bridge.missions.flown_legs import Departure, Point, beyond_plain_limits
from bridge.missions.list_check import (
    SEA_LEVEL_FRAMES,
    TERRAIN_FRAMES,
    UNUSED,
    ListCheck,
    given,
    missing_coordinate,
    refuse_first,
    refuse_frame,
    refuse_position,
)
from protocols.float32 import is_single
from protocols.mission_item import ROI_COMMANDS, Command, MissionItem, MissionResult
from protocols.msp.nav import FLY_HOME, LAST, LEGS, TURNS, NavAction, NavRecord
from protocols.msp.nav_items import GROUND_SPEED, home_item, item_seqs, items_from_records, sent_seqs
from reports.finding import DROPPED, News, RejectingFinding, reject, reject_list
from reports.verdict import Result, Verdict

#: The greatest height at which single precision still resolves a centimetre.
_MAX_HEIGHT_CM = 3_276_700


@dataclass(frozen=True, slots=True)
class NavRules:
    """The rules of one flight controller. current: the current list. others: the other missions in its store."""

    has_home: ClassVar[bool] = True
    profile: NavProfile
    current: Mission = ()
    others: tuple[Mission, ...] = ()

    @property
    def max_items(self) -> int:
        return self.profile.max_items

    def begin(self, count: int, fallback_home: tuple[int, int] | None) -> "NavCheck":
        return NavCheck(self, count, fallback_home)


class NavCheck(ListCheck):
    """The check of one list.

    Home (item 0) is not stored: these flight controllers set their own where they arm. It must be a WAYPOINT, as in
    every list. Without coordinates it is shown at `fallback_home`.
    """

    def __init__(self, rules: NavRules, count: int, fallback_home: tuple[int, int] | None = None) -> None:
        super().__init__(count)
        self._rules = rules
        self._profile = profile = rules.profile
        self._fallback_home = fallback_home
        self._home = home_item(fallback_home)
        self._has_home = False
        self._records: list[NavRecord] = []
        #: The item of each record.
        self._sent: list[MissionItem] = []
        self._jumps = Jumps(back_only=profile.jumps_back_only)
        self._sent_as: dict[int, int] = {}
        self._speed = LegSpeed()
        self._special: dict[int, Callable[[MissionItem], RejectingFinding | None]] = {
            Command.CONDITION_YAW: self._take_heading,
            Command.DO_SET_ROI_NONE: self._take_roi_none,
            Command.DO_JUMP: self._take_jump,
            Command.DO_CHANGE_SPEED: self._take_speed,
        }

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        rule = NAV_RULES.get(item.command)
        self._jumps.places.append(len(self._records))
        if item.seq == 0:
            return self._take_home(item)
        if rule is not None:
            rejection = self._take(item, rule)
        elif special := self._special.get(item.command):
            rejection = refuse_frame(item, needs_position=False) or special(item)
        else:
            rejection = self._drop(item, "command", item.command, "not supported")
        room = self._profile.capacity - sum(map(len, self._rules.others))
        if rejection is None and len(self._records) > room:
            beside = " with the board's other missions: delete one" if self._rules.others else ""
            return reject(MissionResult.NO_SPACE, item, "command", f"more than the {room} that fit{beside}")
        return rejection

    def _take_home(self, home: MissionItem) -> RejectingFinding | None:
        if home.command != Command.NAV_WAYPOINT:
            return refuse_first(home)
        if rejection := refuse_frame(home, needs_position=True):
            return rejection
        self._note_home(home)
        if home.lat_e7 and home.lon_e7 and refuse_position(home) is None:
            alt_m = home.alt_m if math.isfinite(home.alt_m) else 0.0
            self._home, self._has_home = home_item((home.lat_e7, home.lon_e7), alt_m), True
        return None

    def _take(self, item: MissionItem, rule: NavRule) -> RejectingFinding | None:
        """Keep one item as a record. Every value that cannot be stored becomes a finding."""
        if rule.position and (rejection := refuse_position(item)):
            return rejection
        if not math.isfinite(item.alt_m):
            if rule.height is AltitudeUse.FLOWN:
                return self._drop(item, "alt_m", given(item.alt_m), "Alt is not a number")
            item = replace(item, alt_m=0.0)
        if item.command == Command.NAV_LAND:
            if missing_coordinate(item) and self._records and self._records[-1].action == NavAction.RTH:
                self._records[-1] = replace(self._records[-1], p1=LANDS.high)
                return self._drop(item, "command", item.command, "the RTL before it now lands")
            item = placed_landing(item, self._records, self._note, partial(self._note, news=News.WARNING))
        if rule.position and (missing := missing_coordinate(item)):
            return self._drop(item, *missing, "no Lat/Long")
        if rejection := refuse_frame(item, needs_position=rule.position):
            return rejection
        p1 = self._hold(item) if rule.p1 is HOLD else self._fit(item, "p1", rule.p1)
        # MAVLink gives these no meaning for an RTL or a ROI, so they are not needed.
        news = News.NOTICE if rule.height in (AltitudeUse.FLOWN, AltitudeUse.APPROACH) else News.NONE
        for name in ("p2", "p3", "p4"):
            self._fit(item, name, UNUSED, news)
        if not rule.position:
            self._no_position(item)
        self._keep(item, self._record(item, rule, p1))
        return None

    def _hold(self, item: MissionItem) -> int:
        allowed = self._profile.longest_hold
        is_cut = math.isfinite(item.p1) and item.p1 >= allowed.high + 1
        return self._fit(item, "p1", allowed, News.WARNING if is_cut else News.NOTICE)

    def _record(self, item: MissionItem, rule: NavRule, p1: int) -> NavRecord:
        alt_cm, datum = self._height(item, rule)
        action, speed = rule.action, self._speed.cms
        if action is NavAction.POSHOLD_UNLIM:
            action, p1 = self._profile.endless_hold
        elif action is NavAction.WAYPOINT and p1:
            action = NavAction.POSHOLD_TIME
        if item.command in ROI_COMMANDS or (item.command == Command.NAV_WAYPOINT and p1):
            self._sent_as[len(self._records)] = item.command
        if item.command == Command.NAV_LOITER_TURNS:
            self._note(item, "command", item.command, int(Command.NAV_WAYPOINT), "circles not supported", News.WARNING)
        place = (item.lat_e7 or 0, item.lon_e7 or 0) if rule.position else (0, 0)
        if action in (NavAction.WAYPOINT, NavAction.LAND):
            return NavRecord(action, *place, alt_cm, speed, 0, datum)
        return NavRecord(action, *place, alt_cm, p1, speed if action in LEGS else 0, datum)

    def _take_heading(self, item: MissionItem) -> RejectingFinding | None:
        """CONDITION_YAW becomes SET_HEAD: an absolute heading, turned to at the flight controller's own rate."""
        if math.isfinite(item.p4) and item.p4 != 0:
            return self._drop(item, "p4", item.p4, "relative headings are not supported")
        if not math.isfinite(item.p1):
            return self._drop(item, "p1", given(item.p1), "no heading is given")
        heading = math.trunc(item.p1) % 360
        if heading != item.p1:
            news = News.NONE if item.p1 % 360 == heading else News.NOTICE
            self._note(item, "p1", item.p1, heading, "whole degrees", news)
        self._unused(item, "p2", "p3", "p4")
        self._keep(item, NavRecord(NavAction.SET_HEAD, p1=heading))
        return None

    def _take_roi_none(self, item: MissionItem) -> RejectingFinding | None:
        """DO_SET_ROI_NONE becomes SET_HEAD -1, which ends a region of interest and a heading alike."""
        self._unused(item, "p1", "p2", "p3", "p4")
        self._keep(item, NavRecord(NavAction.SET_HEAD, p1=-1))
        return None

    def _take_jump(self, item: MissionItem) -> RejectingFinding | None:
        """Reserve a record. The target is known once all items have arrived."""
        if not (math.isfinite(item.p1) and item.p1 == math.trunc(item.p1) and 1 <= item.p1 < self._count):
            return reject(MissionResult.INVALID_PARAM1, item, "p1", "there is no such item to jump to")
        is_endless = item.p2 < REPEATS.low
        if is_endless:
            self._note(item, "p2", item.p2, REPEATS.low, "for ever", News.WARNING)
        repeats = REPEATS.low if is_endless else self._fit(item, "p2", REPEATS)
        self._unused(item, "p3", "p4")
        self._jumps.wanted.append((len(self._records), item))
        self._keep(item, NavRecord(NavAction.JUMP, p2=repeats))
        return None

    def _take_speed(self, item: MissionItem) -> RejectingFinding | None:
        """DO_CHANGE_SPEED is the speed of the legs that follow."""
        if not self._profile.leg_speed:
            return self._drop(item, "command", item.command, "leg speeds are not supported")
        if math.isfinite(item.p1) and item.p1 not in (0, GROUND_SPEED):
            return self._drop(item, "p1", item.p1, "speed over ground only")
        if self._speed.leaves_it(item):
            return self._drop(item, "p2", given(item.p2), "it changes nothing", News.NONE)
        self._speed.change(item, self._note)
        self._unused(item, "p4")
        return None

    def _refuse_kept_list(self) -> RejectingFinding | None:
        if rejection := self._refuse_without_legs():
            return rejection
        if rejection := self._jumps.aim(self._records, self._note):
            return rejection
        if lost := self._speed.waiting:
            self._drop(lost, "command", lost.command, "no leg follows")
        if not self._profile.ends_on_any_record:
            legs = [place for place, record in enumerate(self._records) if record.action not in TURNS]
            self._cut(legs[-1] + 1, "the mission would not end after it")
        self._cut(flown_size(self._records), "never flown: the RTL before it ends the mission")
        return self._refuse_without_legs() or self._refuse_as_flown()

    def _refuse_without_legs(self) -> RejectingFinding | None:
        if any(record.action in LEGS for record in self._records):
            return None
        return reject_list(MissionResult.INVALID, self._count, "no waypoint to fly to")

    def _cut(self, size: int, why: str) -> None:
        """Drop the last records, from place `size` on."""
        for item in self._sent[size:]:
            self._drop(item, "command", item.command, why, News.WARNING)
        for place in range(size, len(self._records)):
            self._sent_as.pop(place, None)
        del self._records[size:], self._sent[size:]

    def _refuse_as_flown(self) -> RejectingFinding | None:
        """Reject a list that is flown differently than it reads, and warn about such legs."""
        if self._profile.jumps_back_only and (place := jump_within_jump(self._records)) is not None:
            why = "a jump inside another jump's loop never ends"
            return reject(MissionResult.INVALID_PARAM1, self._sent[place], "p1", why)
        limits, departure = self._profile.limits, self._departure()
        lands = lands_after_rth(self._records)
        self._path = path = fly(self._records, departure, limits, lands=lands)
        self._seqs = item_seqs(self._records)
        self._assumed = (*departure.assumed, *(limits.assumed() if limits else ()))
        plain = beyond_plain_limits(path, departure)
        judgements = limits.judge(self._records, path, departure) if limits else plain
        if departure.carried_m:
            judgements = (departure.carried(), *judgements)
        if rejection := self._apply(judgements, self._sent):
            return rejection
        returns = () if self._profile.own_rth_landing else zip(self._sent, self._records, strict=True)
        for item, record in returns:
            if record.action == NavAction.RTH and (record.p1 > 0) != lands:
                why = f"it would {'land' if lands else 'hover'} because of the last item: put this RTL last"
                return reject(MissionResult.INVALID_PARAM1, item, "p1", why)
        return None

    def _departure(self) -> Departure:
        place = self._fallback_home
        craft = None if place is None else Point(*place)
        home = Point(self._home.lat_e7 or 0, self._home.lon_e7 or 0) if self._has_home else None
        first = next((record for record in self._records if record.action in LEGS and record.lat_e7), None)
        return Departure(craft, home, self._home.alt_m or None, first)

    def _conclude(self) -> Verdict[NavRecord]:
        records = (*self._records[:-1], replace(self._records[-1], flag=LAST))
        items = items_from_records(records, self._home, self._sent_as)
        if lost := Counter(name for old in self._rules.current for name in _unshown(old)):
            names = ", ".join(f"{name} ({count})" for name, count in lost.items())
            why = f"Lost with the old list, because MAVLink items cannot show it: {names}"
            self._say(why)
        findings = tuple(sorted(self._findings, key=lambda finding: finding.seq or 0))
        seqs = sent_seqs(records, [item.seq for item in self._sent], self._speed.changed_at)
        flight = self._path.facts(), self._path.shown(self._seqs), self._assumed
        return Verdict(Result.ACCEPTED, MissionResult.ACCEPTED, records, items, findings, self._sent_as, seqs, *flight)

    def _keep(self, item: MissionItem, record: NavRecord) -> None:
        if record.action in LEGS:
            self._speed.waiting = None
        self._records.append(record)
        self._sent.append(item)

    def _drop(
        self, item: MissionItem, name: str, was: float | None, why: str, news: News = News.NOTICE
    ) -> RejectingFinding | None:
        self._jumps.dropped.add(item.seq)
        self._note(item, name, was, DROPPED, why, news)
        return None

    def _height(self, item: MissionItem, rule: NavRule) -> tuple[int, int]:
        """Centimetres, and the bit for their reference level."""
        if rule.height is AltitudeUse.RTH and not self._profile.rth_height:
            self._fit(item, "alt_m", UNUSED)
            return 0, 0
        alt_cm = _centimetres(item.alt_m)
        if not is_single(item.alt_m, alt_cm / 100):
            self._note(item, "alt_m", item.alt_m, alt_cm / 100, "whole cm, at most 32767 m")
        if rule.height is AltitudeUse.RTH:
            if alt_cm < 0:
                self._note(item, "alt_m", item.alt_m, 0, "0 = the board's setting", News.WARNING)
            return max(alt_cm, 0), 0
        above_sea = item.frame in SEA_LEVEL_FRAMES
        counts_from_sea = above_sea and self._profile.sea_level
        if rule.height is not AltitudeUse.POINT:
            alt_cm = self._flown_height(item, alt_cm, above_sea=counts_from_sea)
        if counts_from_sea:
            return alt_cm, 1
        if above_sea or item.frame in TERRAIN_FRAMES:
            self._now_relative(item)
        return alt_cm, 0

    def _flown_height(self, item: MissionItem, alt_cm: int, *, above_sea: bool) -> int:
        """Replace 0 m, and warn about a leg at or below the reference level: it is flown as stored."""
        if alt_cm == 0 and not above_sea:
            self._note(item, "alt_m", item.alt_m, LEAST_HEIGHT_M, "0 m is not allowed", News.WARNING)
            return 100 * LEAST_HEIGHT_M
        if alt_cm <= 0:
            level = "at or below sea level" if above_sea else "below home"
            self._warn(item, "alt_m", f"flown {level}, at {item.alt_m:g} m")
        return alt_cm

    def _unused(self, item: MissionItem, *names: str) -> None:
        """Note values without a meaning, in `names` and the coordinates; the flight is the same."""
        for name in (*names, "alt_m"):
            self._fit(item, name, UNUSED, News.NONE)
        self._no_position(item)


def _unshown(record: NavRecord) -> Iterable[str]:
    """What another planner set in a record, and an item cannot show, if it changes a flight."""
    if record.p3 & ~1 and record.action in LEGS:
        yield "user actions"
    if record.flag == FLY_HOME:
        yield "fly home"
    if record.action == NavAction.LAND and record.p2:
        yield "ground elevation"


def _centimetres(height_m: float) -> int:
    return round(min(max(height_m * 100, -_MAX_HEIGHT_CM), _MAX_HEIGHT_CM))
