# SPDX-License-Identifier: GPL-3.0-or-later
"""A finding: one change, drop or rejection by the mission rules, and the text for the pilot."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from protocols.mavlink.dialect import command_name
from protocols.mission_item import Command, MissionItem, MissionResult

DROPPED = "dropped"
REJECTED = "rejected"
CLEARED = "cleared"
#: The beginning of a danger because of which the board refuses the flight.
NOT_FLOWN = "not flown"
_OF_THE_LIST: Mapping[object, str] = {REJECTED: "Mission rejected: ", CLEARED: "Mission erased: "}

_LABELS = {"lat_e7": "Lat", "lon_e7": "Long", "alt_m": "Alt"}
#: Column heads of Mission Planner's plan screen, param1..4.
_PARAMS: Mapping[int, tuple[str, ...]] = {
    Command.NAV_WAYPOINT: ("Delay", "Hit Rad", "", "Yaw Ang"),
    Command.NAV_LOITER_UNLIM: ("", "Hit Rad", "", "Yaw Ang"),
    Command.NAV_LOITER_TURNS: ("Turns", "Hit Rad", "", "Yaw Ang"),
    Command.NAV_LOITER_TIME: ("Time s", "Hit Rad", "", "yaw per"),
    Command.CONDITION_YAW: ("Deg", "Sec", "Dir 1=CW", "0=Abs 1=Rel"),
    Command.DO_JUMP: ("WP #", "Repeat#", "", ""),
    Command.DO_CHANGE_SPEED: ("Type", "speed m/s", "", ""),
}
#: Items of fences and rally points, of which the first is not home.
_PLACES = frozenset(command for command in Command if command >= Command.FENCE_RETURN_POINT)
_METRES = ("alt_m", "Hit Rad")

#: Makes a finding of an item: field, value as sent, value as stored, reason.
Note = Callable[[MissionItem, str, float | None, float | str | None, str], None]


class News(StrEnum):
    """The importance of a finding to the pilot."""

    DANGER = "danger"  # the flight is refused, stops, or ends badly
    WARNING = "warning"  # something is lost, or flown differently than drawn
    NOTICE = "notice"
    NONE = "none"  # a default was filled in


@dataclass(frozen=True, slots=True)
class Finding:
    """A changed value, a dropped item or a rejected list (docs/mission-rules.md).

    `seq` is the item's number as sent; None for the whole list. `field` is an attribute of MissionItem,
    or "count". `was` is the value as sent, None if not given; `becomes` the value as stored, or DROPPED (the item),
    REJECTED or CLEARED (the list). `command` is the item's MAV_CMD; None for the list, and in missions stored by older
    releases.
    """

    seq: int | None
    field: str
    was: str | float | int | None
    becomes: str | float | int | None
    why: str
    command: int | None = None
    news: News = News.NOTICE

    @property
    def is_warning(self) -> bool:
        return self.news in (News.DANGER, News.WARNING)

    def text(self, count: int = 1) -> str:
        """One line with the reason. `count` items have the same finding."""
        if self.seq is None:
            return _OF_THE_LIST.get(self.becomes, "") + self.why
        is_place = self.command in _PLACES
        subject = f"WP {self.seq}" if self.seq and not is_place else f"Item {self.seq}" if is_place else "Home"
        subject = f"{count} items" if count > 1 else subject
        if self.becomes == REJECTED:
            return f"Rejected, {subject}: {self.why}"
        if self.becomes == DROPPED:
            name = "item" if self.command is None else command_name(self.command)
            return f"{subject}: {name} dropped, {self.why}"
        change = self._change()
        return f"{subject}: {change} ({self.why})" if change else f"{subject}: {self.why}"

    def _change(self) -> str:
        """The old and the new value, or empty if the reason alone says more."""
        is_place = self.field in ("lat_e7", "lon_e7")
        is_return = self.command == Command.NAV_RETURN_TO_LAUNCH and self.field == "alt_m"
        is_told = (is_place or is_return) and self.is_warning
        if self.was == self.becomes or self.field == "frame" or is_told:
            return ""
        label = value_label(self.command, self.field)
        unit = " m" if self.field in _METRES or label in _METRES else ""
        was, becomes = self._shown(self.was), self._shown(self.becomes)
        if self.was is None:
            return f"{label} set to {becomes}{unit}"
        if was == becomes:
            was = f"{self.was:.9g}"  # single precision to the last digit
        verb = "raised" if self.field == "alt_m" and self.news is News.WARNING else "changed"
        return f"{label} {verb} from {was} to {becomes}{unit}"

    def _shown(self, value: str | float | int | None) -> str:
        if value is None or isinstance(value, str):
            return value or "none"
        if self.field == "command":
            return command_name(int(value))
        if self.field in ("lat_e7", "lon_e7"):
            return f"{value / 1e7:.7f}" if value else "0"
        return f"{value:g}"


def without_defaults(findings: Iterable[Finding]) -> list[Finding]:
    """The findings that matter to the pilot, without filled-in defaults."""
    return [finding for finding in findings if finding.news != News.NONE]


def value_label(command: int | None, field: str) -> str:
    """Mission Planner's name for a field of an item."""
    if field not in ("p1", "p2", "p3", "p4"):
        return _LABELS.get(field, field)
    number = int(field[1])
    names = _PARAMS.get(command or 0, ("",) * 4)
    return names[number - 1] or f"param{number}"


@dataclass(frozen=True, slots=True)
class RejectingFinding:
    """The rejection of a list: the MISSION_ACK code, and the finding for the pilot."""

    ack: MissionResult
    finding: Finding


def reject(ack: MissionResult, item: MissionItem, name: str, why: str) -> RejectingFinding:
    """Reject the list because of one item's field `name`."""
    was = getattr(item, name)
    # NaN means "not given". Findings are stored as JSON, which lacks NaN.
    return RejectingFinding(ack, Finding(item.seq, name, was if was == was else None, REJECTED, why, item.command))


def reject_list(ack: MissionResult, count: int, why: str) -> RejectingFinding:
    """Reject a list as a whole."""
    return RejectingFinding(ack, Finding(None, "count", count, REJECTED, why))
