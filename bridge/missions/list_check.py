# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of a mission list, item by item, by the rules of one kind of flight controller.

One controller's rules are a `MissionRules` and its `ListCheck`; `bridge.controllers.harakiri.check` is an example.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from bridge.missions.flown_legs import FlownPath, Judgement
from protocols.mavlink.dialect import command_name
from protocols.mission_item import MAX_LAT_E7, MAX_LON_E7, Command, Frame, MissionItem, MissionResult, behind_home
from reports.finding import DROPPED, Finding, News, RejectingFinding, reject, reject_list
from reports.verdict import CLEARED_LIST, Verdict, rejected

RELATIVE_FRAMES = (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT)
SEA_LEVEL_FRAMES = (Frame.GLOBAL, Frame.GLOBAL_INT)
TERRAIN_FRAMES = (Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT)
#: The MISSION_ACK for a field.
_ACKS = {"lat_e7": MissionResult.INVALID_PARAM5_X, "alt_m": MissionResult.INVALID_PARAM7}


@dataclass(frozen=True, slots=True)
class Range:
    """The whole numbers from `low` to `high`. `instead_of_zero` is stored where 0 is meaningless."""

    low: int
    high: int
    why: str
    instead_of_zero: int = 0

    def fit(self, value: float) -> int:
        """Truncate toward zero, then clamp; NaN and infinities count as 0."""
        whole = math.trunc(value) if math.isfinite(value) else 0
        return min(max(whole, self.low), self.high) or self.instead_of_zero

    def reason(self, value: float) -> str:
        """The reason that `value` is not stored unchanged."""
        if not math.isfinite(value):
            return "not a number"
        whole = math.trunc(value)
        if whole == 0 and self.instead_of_zero:
            return "less than 1" if value else "0 not allowed"
        return "whole numbers only" if self.low != self.high and self.fit(value) == whole else self.why


UNUSED = Range(0, 0, "not used")


class ListCheck(ABC):
    """The check of one list of `count` items, given in order. An item's number is the place in that order."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._taken = 0
        self._findings: list[Finding] = []
        self._rejection: RejectingFinding | None = None
        self._verdict: Verdict[Any] | None = None
        #: The flight of the kept list, the item of each record, and what had to be assumed.
        self._path = FlownPath()
        self._seqs: Sequence[int] = ()
        self._assumed: tuple[str, ...] = ()

    def take(self, item: MissionItem) -> RejectingFinding | None:
        """Check the next item. A rejection is final and is returned as soon as it is certain."""
        if self._rejection is None:
            item = replace(item, seq=self._taken)
            self._taken += 1
            self._rejection = self._judge(item)
        return self._rejection

    def finish(self) -> Verdict[Any]:
        """The verdict, after the rules for the kept list. Raises ValueError if items are missing."""
        if self._rejection is None and self._taken < self._count:
            raise ValueError(f"{self._taken} of {self._count} items taken")
        if self._verdict is None:
            rejection = self._rejection or self._refuse_kept_list()
            if rejection:
                verdict = rejected(tuple(self._findings), rejection)
                self._verdict = replace(verdict, path=self._path.shown(self._seqs), assumed=self._assumed)
            else:
                self._verdict = self._conclude()
        return self._verdict

    @abstractmethod
    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        """Keep or drop the item, or reject the list."""

    @abstractmethod
    def _refuse_kept_list(self) -> RejectingFinding | None:
        """Apply the rules that need the whole list."""

    @abstractmethod
    def _conclude(self) -> Verdict[Any]:
        """The verdict on a list that is not rejected."""

    def _note(
        self,
        item: MissionItem,
        name: str,
        was: float | None,
        becomes: float | str | None,
        why: str,
        news: News = News.NOTICE,
    ) -> None:
        if becomes == DROPPED and news is News.NOTICE and item.command != Command.DO_SET_ROI_NONE:
            news = News.WARNING
        self._findings.append(Finding(item.seq, name, was, becomes, why, item.command, news))

    def _say(self, text: str, news: News = News.WARNING) -> None:
        """Report on the list as a whole."""
        self._findings.append(Finding(None, "count", None, None, text, news=news))

    def _fit(self, item: MissionItem, name: str, allowed: Range, news: News = News.NOTICE) -> int:
        """Convert one field to a whole number that can be stored."""
        value: float = getattr(item, name)
        if (
            allowed.low <= value <= allowed.high
            and value == (stored := int(value))
            and (value or not allowed.instead_of_zero)
        ):
            return stored
        stored = allowed.fit(value)
        if stored != (0 if math.isnan(value) else value):
            self._note(item, name, given(value), stored, allowed.reason(value), news)
        return stored

    def _warn(self, item: MissionItem, name: str, why: str) -> None:
        """Report a value that is stored as sent, but flown differently than a pilot would expect."""
        value = given(getattr(item, name))
        self._note(item, name, value, value, why, News.WARNING)

    def _apply(self, judgements: Iterable[Judgement], sent: Sequence[MissionItem]) -> RejectingFinding | None:
        """Report judgements on the flight. `sent`: the item of each record. The first that rejects ends it."""
        for place, field, why, news in judgements:
            if place is None and news is None:
                return reject_list(MissionResult.INVALID, self._count, why)
            if place is None:
                self._say(why, news or News.DANGER)
            elif news is None:
                return reject(_ACKS.get(field, MissionResult.INVALID), sent[place], field, why)
            else:
                value = given(getattr(sent[place], field))
                self._note(sent[place], field, value, value, why, news)
        return None

    def _no_position(self, item: MissionItem) -> None:
        """An unused position is not reported: QGroundControl sends one with each take-off."""
        for name, value in (("lat_e7", item.lat_e7), ("lon_e7", item.lon_e7)):
            if value:
                self._note(item, name, value, 0, UNUSED.why, News.NONE)

    def _note_home(self, item: MissionItem) -> None:
        """Item 0 is home. MAVSDK's `mission` plugin sends none, so the first waypoint becomes home.

        Mission Planner's "Write Fast" sends home in frame 3, too, but shows itself later (Upload.is_write_fast).
        """
        if item.frame in (*RELATIVE_FRAMES, *TERRAIN_FRAMES):
            self._note(item, "frame", item.frame, int(Frame.GLOBAL), "item 0 became home, not flown to", News.WARNING)

    def _now_relative(self, item: MissionItem) -> None:
        """Report that an altitude is now relative to a different level."""
        level = "sea level" if item.frame in SEA_LEVEL_FRAMES else "terrain"
        why = f"Alt flown above home, not above {level}"
        self._note(item, "frame", item.frame, int(Frame.GLOBAL_RELATIVE_ALT), why, News.WARNING)


class HomeOnly(ListCheck):
    """The check of a list of one item: not a mission, but some clients clear with it.

    MAVSDK clears an ARDUPILOTMEGA vehicle with one item of zeros. Mission Planner's empty Write sends home.
    """

    def _judge(self, item: MissionItem) -> RejectingFinding | None:
        numbers = (item.p1, item.p2, item.p3, item.p4, item.alt_m)
        is_blank = missing_coordinate(item) is not None and not any(given(number) for number in numbers)
        if item.command == Command.NAV_WAYPOINT and item.frame in RELATIVE_FRAMES and is_blank:
            return None
        return _HOME_ONLY

    def _refuse_kept_list(self) -> RejectingFinding | None:
        return None

    def _conclude(self) -> Verdict[Any]:
        return CLEARED_LIST


_HOME_ONLY = reject_list(MissionResult.INVALID, 1, "only home, without a command")


class MissionRules(Protocol):
    """The mission rules of a flight controller: the limits, and the check of a list."""

    @property
    def max_items(self) -> int:
        """The longest list that may fit, home included."""

    @property
    def has_home(self) -> bool:
        """True if item 0 is home."""

    def begin(self, count: int, fallback_home: tuple[int, int] | None) -> ListCheck:
        """Begin the check of `count` items. `fallback_home` (lat_e7, lon_e7) replaces a home without coordinates."""


def check_count(count: int, rules: MissionRules) -> RejectingFinding | None:
    """Check a MISSION_COUNT; 0 clears the list and is valid."""
    if count > rules.max_items:
        return reject_list(MissionResult.NO_SPACE, count, f"{count} items, but only {rules.max_items} fit")
    return None


def begin_check(count: int, rules: MissionRules, fallback_home: tuple[int, int] | None) -> ListCheck:
    """Begin the check of a list of `count` items, 1 or more."""
    return HomeOnly(count) if count == 1 and rules.has_home else rules.begin(count, fallback_home)


def check_list(
    items: Sequence[MissionItem], rules: MissionRules, fallback_home: tuple[int, int] | None = None
) -> Verdict[Any]:
    """Check a whole list. An empty one clears the flight controller's.

    >>> from bridge.controllers.harakiri.check import HarakiriRules
    >>> items = [MissionItem(seq, 16, 3, 0, 0, 0, 0, 453_000_000, 84_000_000, 20.4) for seq in range(2)]
    >>> check_list(items, HarakiriRules()).findings[-1].text()
    'WP 1: Alt changed from 20.4 to 20 m (whole numbers only)'
    """
    if not items:
        return CLEARED_LIST
    if rejection := check_count(len(items), rules):
        return rejected((), rejection)
    check = begin_check(len(items), rules, fallback_home)
    for item in items:
        if check.take(item):
            break
    return check.finish()


def with_home(items: Sequence[MissionItem], home: tuple[int, int] | None) -> Sequence[MissionItem]:
    """The list with the home that a person gives: for a home without coordinates, or before a list without one."""
    first = items[0]
    if home is None:
        return items
    if first.command == Command.NAV_WAYPOINT and missing_coordinate(first):
        return [replace(first, lat_e7=home[0], lon_e7=home[1]), *items[1:]]
    if first.command == Command.NAV_WAYPOINT and first.frame not in (*RELATIVE_FRAMES, *TERRAIN_FRAMES):
        return items
    return behind_home(items, MissionItem(0, Command.NAV_WAYPOINT, Frame.GLOBAL, 0, 0, 0, 0, *home, 0.0))


def refuse_frame(item: MissionItem, *, needs_position: bool) -> RejectingFinding | None:
    """Reject frames without a usable position. Frame MISSION is accepted for commands that need none."""
    known = item.frame in (*RELATIVE_FRAMES, *SEA_LEVEL_FRAMES, *TERRAIN_FRAMES)
    if known or (item.frame == Frame.MISSION and not needs_position):
        return None
    return reject(MissionResult.UNSUPPORTED_FRAME, item, "frame", f"frame {item.frame} not supported")


def refuse_first(item: MissionItem) -> RejectingFinding:
    """Item 0 is a command, so the list lacks a home."""
    why = f"put home first, item 0 is {command_name(item.command)}"
    return reject(MissionResult.INVALID, item, "command", why)


def refuse_position(item: MissionItem) -> RejectingFinding | None:
    if abs(item.lat_e7 or 0) > MAX_LAT_E7:
        return reject(MissionResult.INVALID_PARAM5_X, item, "lat_e7", "latitude beyond 90 deg")
    if abs(item.lon_e7 or 0) > MAX_LON_E7:
        return reject(MissionResult.INVALID_PARAM6_Y, item, "lon_e7", "longitude beyond 180 deg")
    return None


def missing_coordinate(item: MissionItem) -> tuple[str, int | None] | None:
    """The missing coordinate: the field name and the value in place of it, or None if both are given."""
    if item.lat_e7 and item.lon_e7:
        return None
    return ("lon_e7", item.lon_e7) if item.lat_e7 else ("lat_e7", item.lat_e7)


def given(value: float | None) -> float | None:
    """The value, or None for NaN or an omitted coordinate, "not given"."""
    return None if value is None or math.isnan(value) else value
