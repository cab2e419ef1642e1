# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for a Harakiri's mission list (docs/mission-rules.md).

A list that is kept is also judged as the flight core flies it, and refuses it in the air (firmware/naze_flight.c,
check_record).
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

from bridge.controllers.harakiri.rules import (
    CRUISE,
    NO_ROI_KNOWN,
    NOSE_ON_ROI,
    TAKEOFF_MAX_M,
    USUAL_CAPACITY,
    USUAL_WP_RADIUS_CM,
    CommandRule,
    InList,
    command_rules,
    items_from_records,
)
from bridge.missions.flown_legs import (
    Departure,
    FlownPath,
    Judgement,
    Leg,
    Point,
    beyond_plain_limits,
    first_of,
    in_metres,
)
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
from bridge.model.ground_track import Place, distance_m
from protocols.mavlink.dialect import command_name
from protocols.mission_item import Command, MissionItem, MissionResult
from protocols.msp.mission import WpCommand, WpRecord
from reports.finding import CLEARED, DROPPED, NOT_FLOWN, Finding, News, RejectingFinding, reject
from reports.verdict import Result, Verdict

#: NF_MAX_LEG_M, and NF_TAKEOFF_LEAST_M, also of legs, and NF_TAKEOFF_MOST_M.
MAX_LEG_M, LEAST_M, TAKEOFF_MOST_M = 2000, 2, 15
PLACED = (WpCommand.WAYPOINT, WpCommand.LOITER_UNLIM, WpCommand.LOITER_TURNS, WpCommand.LOITER_TIME)
_WITHOUT_HEIGHT = (WpCommand.LAND, WpCommand.SETROI)


@dataclass(frozen=True, slots=True)
class FlightLimits:
    """The settings of a Harakiri with mission flight that decide about a list, and their defaults: metres."""

    mission_first: int = 200
    mission_height: int = 100
    #: 0: any distance from home.
    mission_radius: int = 0
    is_assumed: bool = field(default=False, kw_only=True)

    def assumed(self) -> tuple[str, ...]:
        return "mission flight", f"mission_first = {self.mission_first}", f"mission_height = {self.mission_height}"

    def judge(self, records: Sequence[WpRecord], path: FlownPath, departure: Departure) -> Iterable[Judgement]:
        """The core compares whole metres, rounded down."""
        long, high, limited, outside = [], [], [], []
        home = departure.place or departure.home
        for leg in path.legs:
            off_m = 0.0 if home is None else distance_m(home, leg.end)
            if 0 < self.mission_radius < int(off_m):
                why = f"{NOT_FLOWN}: {in_metres(off_m)} off, mission_radius {self.mission_radius} m"
                outside.append((leg.target, why))
            elif leg.is_first and int(leg.length_m) > self.mission_first:
                why = f"{NOT_FLOWN}: {in_metres(leg.length_m)} off, mission_first {self.mission_first} m"
                if home and departure.home and int(distance_m(departure.home, leg.end)) <= self.mission_first:
                    why = f"starts only at the list's home, {in_metres(distance_m(home, departure.home))} off"
                yield Judgement(leg.target, "lat_e7", why)
            elif int(leg.length_m) > MAX_LEG_M:
                long.append((leg.target, f"{NOT_FLOWN}: {in_metres(leg.length_m)} leg, at most 2 km"))
        for place, record in enumerate(records):
            if not place or record.command in _WITHOUT_HEIGHT:
                continue
            if (flown_m := _flown_m(record)) > self.mission_height:
                high.append((place, f"{NOT_FLOWN}: {flown_m} m, mission_height {self.mission_height}"))
            elif flown_m != record.height_m:
                limited.append((place, f"{record.height_m} m is flown at {flown_m} m"))
        yield from first_of(limited, "alt_m", News.WARNING)
        yield from first_of(long, "lat_e7")
        yield from first_of(outside, "lat_e7")
        yield from first_of(high, "alt_m")


USUAL_FLIGHT = FlightLimits(is_assumed=True)


def _flown_m(record: WpRecord) -> int:
    height_m = max(record.height_m, LEAST_M)
    return min(height_m, TAKEOFF_MOST_M) if record.command == WpCommand.TAKEOFF else height_m


def fly(records: Sequence[WpRecord], departure: Departure) -> FlownPath:
    """The way of the records. The first is the list's home. RETURN_TO_LAUNCH leads to the place of arming."""
    legs: list[Leg] = []
    here: Place | None = departure.place
    here_cm = None
    for place, record in enumerate(records[1:], 1):
        if record.command == WpCommand.TAKEOFF:
            here_cm = 100 * _flown_m(record)
        end = record if record.command in PLACED else departure.place
        if end is None or not (record.command in PLACED or record.command == WpCommand.RETURN_TO_LAUNCH):
            continue
        end_cm = 100 * max(record.height_m, LEAST_M)
        is_return = record.command == WpCommand.RETURN_TO_LAUNCH
        start_cm = end_cm if here_cm is None else here_cm
        start = here or end
        length_m = 0.0 if start is end else distance_m(start, end)
        legs.append(Leg(place, place, start, end, length_m, start_cm, end_cm, not legs, is_return))
        here, here_cm = end, end_cm
    return FlownPath(legs, lands=records[-1].command == WpCommand.LAND)


@dataclass(frozen=True, slots=True)
class HarakiriRules:
    """The rules' inputs from the flight controller and the settings.

    capacity: records, home included. wp_radius_cm: its gps_wp_radius. takeoff_max_m: the highest take-off.
    flight: of a board that flies the list, or None if it only stores it.
    """

    has_home: ClassVar[bool] = True
    capacity: int = USUAL_CAPACITY
    wp_radius_cm: int = USUAL_WP_RADIUS_CM
    takeoff_max_m: int = TAKEOFF_MAX_M
    flight: FlightLimits | None = USUAL_FLIGHT

    @property
    def max_items(self) -> int:
        """The longest list, home included: every item may become a record."""
        return self.capacity

    def begin(self, count: int, fallback_home: tuple[int, int] | None) -> "HarakiriCheck":
        return HarakiriCheck(self, count, fallback_home)


class HarakiriCheck(ListCheck):
    """The check of one list. `fallback_home` (lat_e7, lon_e7) replaces a home without coordinates.

    Our own decisions: home without a finite altitude rejects the list with INVALID_PARAM7, because home cannot be
    dropped; coordinates out of range reject the list even if the item would be dropped for another reason, and so does
    INT32_MAX, MAVLink's "not given" for an integer coordinate; a fallback home with a 0 in it does not count.
    """

    def __init__(self, rules: HarakiriRules, count: int, fallback_home: tuple[int, int] | None = None) -> None:
        super().__init__(count)
        self._rules = command_rules(rules.wp_radius_cm, rules.takeoff_max_m)
        self._fallback_home = fallback_home if fallback_home and all(fallback_home) else None
        self._roi_known = False
        self._kept: list[tuple[MissionItem, CommandRule]] = []  # items as sent, home included
        self._records: list[WpRecord] = []
        self._roi_commands: dict[int, int] = {}
        self._flight = rules.flight
        self._raised_returns: set[int] = set()

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        rule = self._rules.get(item.command)
        rejection = self._refuse(item, rule)
        if rejection is not None or rule is None or self._drops(item, rule):
            return rejection
        # The frame is checked only for an item that is kept.
        rejection = refuse_frame(item, needs_position=rule.position)
        if rejection is None:
            self._keep(self._placed_home(item) if item.seq == 0 else item, rule)
        return rejection

    def _conclude(self) -> Verdict[WpRecord]:
        findings = tuple(sorted(self._findings, key=lambda finding: finding.seq or 0))
        if len(self._records) == 1:
            cleared = Finding(None, "count", self._count, CLEARED, "no command left", news=News.WARNING)
            return Verdict(Result.CLEARED, MissionResult.ACCEPTED, findings=(*findings, cleared))
        return Verdict(
            Result.ACCEPTED,
            MissionResult.ACCEPTED,
            tuple(self._records),
            tuple(items_from_records(self._records, self._roi_commands)),
            findings,
            self._roi_commands,
            tuple([item.seq for item, _ in self._kept]),
            self._path.facts(),
            self._path.shown(self._seqs),
            self._assumed,
        )

    def _refuse(self, item: MissionItem, rule: CommandRule | None) -> RejectingFinding | None:
        if item.seq == 0 and item.command != Command.NAV_WAYPOINT:
            return refuse_first(item)
        if rule is None:
            self._leave_out(item)
            return None
        if rule.place is not InList.ANY and (fault := self._misplaced(item.seq, rule)):
            return reject(MissionResult.INVALID, item, "command", fault)
        if rule.position and (rejection := refuse_position(item)):
            return rejection
        return self._refuse_home(item) if item.seq == 0 else None

    def _misplaced(self, seq: int, rule: CommandRule) -> str | None:
        is_last = seq == self._count - 1
        match rule.place:
            case InList.ITEM_1 if seq != 1:
                return f"{rule.name} must be item 1{self._way_out(seq)}"
            case InList.LAST if not is_last:
                return f"{rule.name} must be last"
            case InList.NOT_LAST if is_last:
                return f"{rule.name} cannot be last"
        return None

    def _way_out(self, seq: int) -> str:
        """What to remove, if only items that are not stored anyway are before this item."""
        dropped = [finding for finding in self._findings if finding.becomes == DROPPED]
        if not dropped or len(self._kept) > 1:
            return ""
        names = ", ".join(f"WP {each.seq} {command_name(each.command or 0)}" for each in dropped[:2])
        return f": remove {names}, which {'is' if seq == 2 else 'are'} not stored"

    def _refuse_home(self, home: MissionItem) -> RejectingFinding | None:
        if not math.isfinite(home.alt_m):
            return reject(MissionResult.INVALID_PARAM7, home, "alt_m", "Alt is not a number")
        if (missing := missing_coordinate(home)) and self._fallback_home is None:
            return reject(MissionResult.INVALID_PARAM5_X, home, missing[0], "no Lat/Long")
        return None

    def _leave_out(self, item: MissionItem) -> None:
        why = "not supported"
        if item.command == Command.DO_SET_ROI_NONE:
            self._roi_known = False
            why = "no ROI from here on"
        self._note(item, "command", item.command, DROPPED, why)

    def _drops(self, item: MissionItem, rule: CommandRule) -> bool:
        # RETURN_TO_LAUNCH gets the lowest altitude instead.
        needs_height = rule.height is not UNUSED and rule.record is not WpCommand.RETURN_TO_LAUNCH
        if needs_height and not math.isfinite(item.alt_m):
            self._note(item, "alt_m", given(item.alt_m), DROPPED, "Alt is not a number")
            return True
        if item.seq and rule.position and (missing := missing_coordinate(item)):
            self._note(item, *missing, DROPPED, "no Lat/Long")
            return True
        return False

    def _placed_home(self, home: MissionItem) -> MissionItem:
        if missing_coordinate(home) is None or self._fallback_home is None:
            return home
        lat_e7, lon_e7 = self._fallback_home
        why = "no Lat/Long sent, GPS position used"
        news = News.WARNING
        for name, was, becomes in (("lat_e7", home.lat_e7, lat_e7), ("lon_e7", home.lon_e7, lon_e7)):
            if was != becomes:
                self._note(home, name, was, becomes, why, news)
                news = News.NONE
        return replace(home, lat_e7=lat_e7, lon_e7=lon_e7)

    def _keep(self, item: MissionItem, rule: CommandRule) -> None:
        """Keep one item. Every value that cannot be stored becomes a finding."""
        if item.seq and item.frame in (*SEA_LEVEL_FRAMES, *TERRAIN_FRAMES) and rule.height is not UNUSED:
            self._now_relative(item)
        if item.seq == 0:
            self._note_home(item)
        no_nose = rule.p4 is NOSE_ON_ROI and not self._roi_known
        lat_e7, lon_e7 = (item.lat_e7 or 0, item.lon_e7 or 0) if rule.position else (0, 0)
        is_raised = rule.height is CRUISE and (not math.isfinite(item.alt_m) or math.trunc(item.alt_m) == 0)
        p1 = self._fit(item, "p1", rule.p1)
        # Filled-in defaults and the radius of home are not reported: home is not flown to.
        p2 = self._fit(
            item, "p2", rule.p2, News.NOTICE if item.seq and item.p2 and not math.isnan(item.p2) else News.NONE
        )
        if item.p3:
            self._fit(item, "p3", UNUSED)
        p4 = self._fit(item, "p4", NO_ROI_KNOWN if no_nose else rule.p4)
        if not rule.position:
            self._no_position(item)
        if is_raised and rule.record is WpCommand.RETURN_TO_LAUNCH:
            height_m = self._raise_return(item)
        else:
            # A home of height 0 is not reported: QGroundControl sends it without terrain data.
            news = News.NOTICE if not is_raised else News.WARNING if item.seq else News.NONE
            height_m = self._fit(item, "alt_m", rule.height, news)
        has_turns = rule.record is WpCommand.LOITER_TURNS
        if rule.record is WpCommand.SETROI:
            self._roi_known = True
            self._roi_commands[len(self._records)] = item.command
        self._kept.append((item, rule))
        self._records.append(
            WpRecord(
                lat_e7,
                lon_e7,
                height_m,
                roi_heading=p4,
                time=0 if has_turns else p1,
                radius_m=p2,
                turns=p1 if has_turns else 0,
                command=int(rule.record),
            )
        )

    def _raise_return(self, item: MissionItem) -> int:
        """QGroundControl's Return item lacks an altitude."""
        lowest_m = CRUISE.instead_of_zero
        why = f"RTL home at {lowest_m} m: set Alt, or a WP at home"
        self._note(item, "alt_m", given(item.alt_m), lowest_m, why, News.DANGER)
        self._raised_returns.add(len(self._records))
        return lowest_m

    def _refuse_kept_list(self) -> RejectingFinding | None:
        """Apply the rules for `last` and `alone` to the kept list. Dropping items does not change first and last."""
        last, last_rule = self._kept[-1]
        if last_rule.place is InList.NOT_LAST:
            return reject(MissionResult.INVALID, last, "command", f"{last_rule.name} would be last: rest dropped")
        commands = [kept for kept in self._kept[1:] if kept[1].record is not WpCommand.SETROI]
        if len(commands) == 1 and not commands[0][1].alone:
            item, rule = commands[0]
            return reject(MissionResult.INVALID, item, "command", f"{rule.name} cannot be alone")
        return self._apply(self._flown(), [item for item, _ in self._kept])

    def _flown(self) -> Iterator[Judgement]:
        """What is flown differently than it reads, or not at all."""
        craft = self._fallback_home
        home = Point(self._records[0].lat_e7, self._records[0].lon_e7)
        first = None
        for record in self._records[1:]:
            if record.command in PLACED:
                first = record
                break
        departure = Departure(Point(*craft) if craft else None, home, first=first)
        self._path = path = fly(self._records, departure)
        self._seqs = range(len(self._records))
        self._assumed = departure.assumed
        if self._flight is not None and self._flight.is_assumed:
            self._assumed += self._flight.assumed()
        if departure.carried_m:
            yield departure.carried()
        if self._flight is None:
            yield from beyond_plain_limits(path, departure)
        else:
            yield from self._flight.judge(self._records, path, departure)
        for leg in path.legs:
            if leg.is_return and leg.target not in self._raised_returns and (leg.end_cm or 0) < path.highest_cm:
                why = f"RTL flies home at {(leg.end_cm or 0) / 100:g} m, below the {path.highest_cm / 100:g} m"
                yield Judgement(leg.target, "alt_m", why)
