"""The rules for a mission list (mission-rules.md): what a list becomes on the flight controller, and why."""

import math
from collections.abc import Sequence
from dataclasses import replace

from bridge.finding import CLEARED, DROPPED, REJECTED, Finding, Rejection
from bridge.mission_records import items_from_records
from bridge.mission_rules import (
    NO_ROI_KNOWN,
    NOSE_ON_ROI,
    UNUSED,
    CommandRule,
    Place,
    Range,
    RuleProfile,
    command_rules,
)
from bridge.verdict import Result, Verdict
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.wp_record import WpCommand, WpRecord

__all__ = [
    "Finding",
    "MissionCheck",
    "Rejection",
    "Result",
    "RuleProfile",
    "Verdict",
    "check_count",
    "check_list",
    "items_from_records",
]

_MAX_LAT_E7 = 90 * 10**7
_MAX_LON_E7 = 180 * 10**7
_RELATIVE_FRAMES = (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT)
_OTHER_DATUM_FRAMES = (
    Frame.GLOBAL,
    Frame.GLOBAL_INT,
    Frame.GLOBAL_TERRAIN_ALT,
    Frame.GLOBAL_TERRAIN_ALT_INT,
)


def check_count(count: int, profile: RuleProfile) -> Rejection | None:
    """Judge a MISSION_COUNT; 0 clears the list and is no fault."""
    if count == 1:
        return _rejection(MissionResult.INVALID, None, "count", count, "only a home point, no command")
    if count > profile.capacity:
        why = f"{count} items, {profile.capacity} fit"
        return _rejection(MissionResult.NO_SPACE, None, "count", count, why)
    return None


def check_list(
    items: Sequence[MissionItem], profile: RuleProfile, fallback_home: tuple[int, int] | None = None
) -> Verdict:
    """Judge a whole list; without items it clears the flight controller's."""
    if not items:
        return Verdict(Result.CLEARED, MissionResult.ACCEPTED)
    if rejection := check_count(len(items), profile):
        return _rejected((), rejection)
    check = MissionCheck(profile, len(items), fallback_home)
    for item in items:
        if check.take(item):
            break
    return check.finish()


class MissionCheck:
    """The check of one list, item by item as it comes in.

    `count` items will come, in order; an item's number is its place in that order. `fallback_home` (lat_e7, lon_e7)
    stands in for a home without coordinates.

    What mission-rules.md leaves open, decided here: home without a finite height is a list INVALID_PARAM7, because
    home cannot be dropped; a height that is not used (LAND, ROI) may be anything; coordinates out of range reject the
    list even if the item lacks something else and would be dropped, and INT32_MAX, MAVLink's "not given" for an integer
    coordinate, is out of range like any other; a fallback home with a 0 in it is none.
    """

    def __init__(self, profile: RuleProfile, count: int, fallback_home: tuple[int, int] | None = None) -> None:
        self._rules = command_rules(profile)
        self._count = count
        self._fallback_home = fallback_home if fallback_home and all(fallback_home) else None
        self._taken = 0
        self._roi_known = False
        self._kept: list[tuple[MissionItem, CommandRule]] = []  # items as sent, home included
        self._records: list[WpRecord] = []
        self._roi_commands: dict[int, int] = {}
        self._findings: list[Finding] = []
        self._rejection: Rejection | None = None

    def take(self, item: MissionItem) -> Rejection | None:
        """Judge the next item; a rejection is final and comes with the first item that proves it."""
        if self._rejection is None:
            item = replace(item, seq=self._taken)
            self._taken += 1
            rule = self._rules.get(item.command)
            self._rejection = self._refuse(item, rule)
            if self._rejection is None:
                self._keep_or_drop(item, rule)
        return self._rejection

    def finish(self) -> Verdict:
        """Return the verdict, with the rules for what is kept; ValueError if items are still to come."""
        if self._rejection is None and self._taken < self._count:
            raise ValueError(f"{self._taken} of {self._count} items taken")
        findings = tuple(self._findings)
        if rejection := self._rejection or self._refuse_kept_list():
            return _rejected(findings, rejection)
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
        needs_position = rule is not None and rule.position
        if not _frame_is_supported(item.frame, needs_position):
            why = f"frame {item.frame} is not supported"
            return _rejection(MissionResult.UNSUPPORTED_FRAME, item.seq, "frame", item.frame, why)
        if item.seq == 0 and item.command != Command.NAV_WAYPOINT:
            return _rejection(MissionResult.INVALID, 0, "command", item.command, "must be a WAYPOINT")
        if rule is None:
            return None
        if fault := self._misplaced(item.seq, rule):
            return _rejection(MissionResult.INVALID, item.seq, "command", item.command, fault)
        if rule.position:
            if abs(item.lat_e7 or 0) > _MAX_LAT_E7:
                why = "latitude beyond 90 degrees"
                return _rejection(MissionResult.INVALID_PARAM5_X, item.seq, "lat_e7", item.lat_e7, why)
            if abs(item.lon_e7 or 0) > _MAX_LON_E7:
                why = "longitude beyond 180 degrees"
                return _rejection(MissionResult.INVALID_PARAM6_Y, item.seq, "lon_e7", item.lon_e7, why)
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
            return _rejection(MissionResult.INVALID_PARAM7, 0, "alt_m", _given(home.alt_m), "height is not a number")
        if not (home.lat_e7 and home.lon_e7) and self._fallback_home is None:
            missing = "lon_e7" if home.lat_e7 else "lat_e7"
            return _rejection(MissionResult.INVALID_PARAM5_X, 0, missing, None, "it has no coordinates")
        return None

    def _keep_or_drop(self, item: MissionItem, rule: CommandRule | None) -> None:
        if item.command == Command.DO_SET_ROI_NONE:
            self._roi_known = False
            self._note(item, "command", item.command, DROPPED, "no ROI is known from here on")
        elif rule is None:
            why = f"command {item.command} is not supported"
            self._note(item, "command", item.command, DROPPED, why)
        elif rule.uses_height and not math.isfinite(item.alt_m):
            self._note(item, "alt_m", _given(item.alt_m), DROPPED, "height is not a number")
        elif item.seq == 0:
            self._keep(self._placed_home(item), rule)
        elif rule.position and not (item.lat_e7 and item.lon_e7):
            missing, was = ("lon_e7", item.lon_e7) if item.lat_e7 else ("lat_e7", item.lat_e7)
            self._note(item, missing, was, DROPPED, "it has no coordinates")
        else:
            self._keep(item, rule)

    def _placed_home(self, home: MissionItem) -> MissionItem:
        if (home.lat_e7 and home.lon_e7) or self._fallback_home is None:
            return home
        lat_e7, lon_e7 = self._fallback_home
        self._note(home, "lat_e7", home.lat_e7, lat_e7, "not given, GPS position")
        self._note(home, "lon_e7", home.lon_e7, lon_e7, "not given, GPS position")
        return replace(home, lat_e7=lat_e7, lon_e7=lon_e7)

    def _keep(self, item: MissionItem, rule: CommandRule) -> None:
        """Store one item; every value that does not survive becomes a finding."""
        if item.seq and item.frame in _OTHER_DATUM_FRAMES and rule.uses_height:
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
            self._note(item, name, _given(value), stored, "whole numbers only" if truncated else allowed.why)
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
            return _rejection(MissionResult.INVALID, last.seq, "command", last.command, why)
        commands = [kept for kept in self._kept[1:] if kept[1].record is not WpCommand.SETROI]
        if len(commands) == 1 and not commands[0][1].alone:
            item, rule = commands[0]
            why = f"{rule.name} must not be alone"
            return _rejection(MissionResult.INVALID, item.seq, "command", item.command, why)
        return None

    def _note(self, item: MissionItem, name: str, was: float | None, becomes: float | str | None, why: str) -> None:
        self._findings.append(Finding(item.seq, name, was, becomes, why))


def _frame_is_supported(frame: int, needs_position: bool) -> bool:
    if frame == Frame.MISSION:
        return not needs_position
    return frame in _RELATIVE_FRAMES or frame in _OTHER_DATUM_FRAMES


def _given(value: float) -> float | None:
    return None if math.isnan(value) else value


def _rejection(ack: MissionResult, seq: int | None, name: str, was: float | None, why: str) -> Rejection:
    return Rejection(ack, Finding(seq, name, was, REJECTED, why))


def _rejected(findings: tuple[Finding, ...], rejection: Rejection) -> Verdict:
    return Verdict(Result.REJECTED, rejection.ack, findings=(*findings, rejection.finding))
