# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules for a Harakiri's mission list (mission-rules.md): what a list becomes there, and why."""

import math
from dataclasses import dataclass, replace

from bridge.controllers.harakiri.records import items_from_records
from bridge.controllers.harakiri.rules import (
    NO_ROI_KNOWN,
    NOSE_ON_ROI,
    TAKEOFF_MAX_M,
    UNUSED,
    USUAL_CAPACITY,
    USUAL_WP_RADIUS_CM,
    CommandRule,
    Place,
    Range,
    command_rules,
)
from bridge.missions.list_check import (
    SEA_LEVEL_FRAMES,
    TERRAIN_FRAMES,
    ListCheck,
    given,
    missing_coordinate,
    refuse_frame,
    refuse_position,
)
from bridge.model.finding import CLEARED, DROPPED, Finding, Rejection, reject
from bridge.model.verdict import Result, Verdict
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.wp_record import WpCommand, WpRecord


@dataclass(frozen=True, slots=True)
class HarakiriRules:
    """What the rules need to know of the flight controller and the settings.

    capacity: records it can hold, home included. wp_radius_cm: its gps_wp_radius. takeoff_max_m: highest take-off.
    """

    capacity: int = USUAL_CAPACITY
    wp_radius_cm: int = USUAL_WP_RADIUS_CM
    takeoff_max_m: int = TAKEOFF_MAX_M

    @property
    def max_items(self) -> int:
        """The longest list: every item may become a record."""
        return self.capacity

    def begin(self, count: int, fallback_home: tuple[int, int] | None) -> "HarakiriCheck":
        """Begin a list."""
        return HarakiriCheck(self, count, fallback_home)


class HarakiriCheck(ListCheck):
    """The check of one list. `fallback_home` (lat_e7, lon_e7) stands in for a home without coordinates.

    What mission-rules.md leaves open, decided here: home without a finite height is a list INVALID_PARAM7, because
    home cannot be dropped; a height that is not used (LAND, ROI) may be anything; coordinates out of range reject the
    list even if the item lacks something else and would be dropped, and INT32_MAX, MAVLink's "not given" for an integer
    coordinate, is out of range like any other; a fallback home with a 0 in it is none.
    """

    def __init__(self, rules: HarakiriRules, count: int, fallback_home: tuple[int, int] | None = None) -> None:
        super().__init__(count)
        self._rules = command_rules(rules.wp_radius_cm, rules.takeoff_max_m)
        self._fallback_home = fallback_home if fallback_home and all(fallback_home) else None
        self._roi_known = False
        self._kept: list[tuple[MissionItem, CommandRule]] = []  # items as sent, home included
        self._records: list[WpRecord] = []
        self._roi_commands: dict[int, int] = {}

    def _judge(self, item: MissionItem) -> Rejection | None:
        rule = self._rules.get(item.command)
        rejection = self._refuse(item, rule)
        if rejection is None:
            self._keep_or_drop(item, rule)
        return rejection

    def _conclude(self) -> Verdict[WpRecord]:
        findings = tuple(self._findings)
        if len(self._records) == 1:
            why = "no command left, list erased"
            cleared = Finding(None, "count", self._count, CLEARED, why)
            return Verdict(Result.CLEARED, MissionResult.ACCEPTED, findings=(*findings, cleared))
        return Verdict(
            Result.ACCEPTED,
            MissionResult.ACCEPTED,
            tuple(self._records),
            tuple(items_from_records(self._records, self._roi_commands)),
            findings,
            self._roi_commands,
        )

    def _refuse(self, item: MissionItem, rule: CommandRule | None) -> Rejection | None:
        """Find what rejects the list as soon as this item is seen."""
        if rejection := refuse_frame(item, needs_position=rule is not None and rule.position):
            return rejection
        if item.seq == 0 and item.command != Command.NAV_WAYPOINT:
            return reject(MissionResult.INVALID, 0, "command", item.command, "must be a WAYPOINT")
        if rule is None:
            return None
        if fault := self._misplaced(item.seq, rule):
            return reject(MissionResult.INVALID, item.seq, "command", item.command, fault)
        if rule.position and (rejection := refuse_position(item)):
            return rejection
        return self._refuse_home(item) if item.seq == 0 else None

    def _misplaced(self, seq: int, rule: CommandRule) -> str | None:
        is_last = seq == self._count - 1
        match rule.place:
            case Place.ITEM_1 if seq != 1:
                return f"{rule.name} must be item 1"
            case Place.LAST if not is_last:
                return f"{rule.name} must be the last item"
            case Place.NOT_LAST if is_last:
                return f"{rule.name} cannot be the last item"
        return None

    def _refuse_home(self, home: MissionItem) -> Rejection | None:
        if not math.isfinite(home.alt_m):
            return reject(MissionResult.INVALID_PARAM7, 0, "alt_m", given(home.alt_m), "height is not a number")
        if (missing := missing_coordinate(home)) and self._fallback_home is None:
            return reject(MissionResult.INVALID_PARAM5_X, 0, missing[0], None, "it has no coordinates")
        return None

    def _keep_or_drop(self, item: MissionItem, rule: CommandRule | None) -> None:
        if item.command == Command.DO_SET_ROI_NONE:
            self._roi_known = False
            self._note(item, "command", item.command, DROPPED, "no ROI is known from here on")
        elif rule is None:
            why = f"command {item.command} is not supported"
            self._note(item, "command", item.command, DROPPED, why)
        elif rule.uses_height and not math.isfinite(item.alt_m):
            self._note(item, "alt_m", given(item.alt_m), DROPPED, "height is not a number")
        elif item.seq == 0:
            self._keep(self._placed_home(item), rule)
        elif rule.position and (missing := missing_coordinate(item)):
            self._note(item, *missing, DROPPED, "it has no coordinates")
        else:
            self._keep(item, rule)

    def _placed_home(self, home: MissionItem) -> MissionItem:
        if missing_coordinate(home) is None or self._fallback_home is None:
            return home
        lat_e7, lon_e7 = self._fallback_home
        self._note(home, "lat_e7", home.lat_e7, lat_e7, "not given, GPS position")
        self._note(home, "lon_e7", home.lon_e7, lon_e7, "not given, GPS position")
        return replace(home, lat_e7=lat_e7, lon_e7=lon_e7)

    def _keep(self, item: MissionItem, rule: CommandRule) -> None:
        """Store one item; every value that does not survive becomes a finding."""
        if item.seq and item.frame in (*SEA_LEVEL_FRAMES, *TERRAIN_FRAMES) and rule.uses_height:
            self._note(item, "frame", item.frame, int(Frame.GLOBAL_RELATIVE_ALT), "height taken as relative")
        no_nose = rule.p4 is NOSE_ON_ROI and not self._roi_known
        p1 = self._fit(item, "p1", item.p1, rule.p1)
        p2 = self._fit(item, "p2", item.p2, rule.p2)
        self._fit(item, "p3", item.p3, UNUSED)
        p4 = self._fit(item, "p4", item.p4, NO_ROI_KNOWN if no_nose else rule.p4)
        lat_e7 = self._coordinate(item, "lat_e7", item.lat_e7, rule)
        lon_e7 = self._coordinate(item, "lon_e7", item.lon_e7, rule)
        height_m = self._fit(item, "alt_m", item.alt_m, rule.height)
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

    def _fit(self, item: MissionItem, name: str, value: float, allowed: Range) -> int:
        stored = allowed.fit(value)
        if stored != (0 if math.isnan(value) else value):
            truncated = math.isfinite(value) and stored == math.trunc(value)
            self._note(item, name, given(value), stored, "whole numbers only" if truncated else allowed.why)
        return stored

    def _coordinate(self, item: MissionItem, name: str, value: int | None, rule: CommandRule) -> int:
        if rule.position:
            return value or 0
        if value:
            self._note(item, name, value, 0, f"not used by {rule.name}")
        return 0

    def _refuse_kept_list(self) -> Rejection | None:
        """Apply the rules for last and alone to what is kept; what is first and last as received stays so."""
        last, last_rule = self._kept[-1]
        if last_rule.place is Place.NOT_LAST:
            why = f"{last_rule.name} is last of what is kept"
            return reject(MissionResult.INVALID, last.seq, "command", last.command, why)
        commands = [kept for kept in self._kept[1:] if kept[1].record is not WpCommand.SETROI]
        if len(commands) == 1 and not commands[0][1].alone:
            item, rule = commands[0]
            why = f"{rule.name} must not be alone"
            return reject(MissionResult.INVALID, item.seq, "command", item.command, why)
        return None
