# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions as plain data, on the control socket and in the output of --json."""

import json
import math
from collections.abc import Callable, Hashable, Iterable
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, TypeGuard

from protocols.mission_item import MissionItem, identify
from protocols.plain_text import plain_text
from reports.finding import Finding, News, without_defaults
from reports.verdict import Verdict

Json = dict[str, Any]

#: The value of "ack" for a mission that was accepted.
ACCEPTED = "MAV_MISSION_ACCEPTED"
#: Items in one request: no flight controller stores more, and the rules check them on a daemon's event loop.
MAX_ITEMS = 500
#: The greatest number allowed in a request.
MOST = 2**31 - 1
MOST_WHOLE = 2**53

_SCALARS = frozenset((float, int, str, bool, type(None)))
_WHOLE = {"seq": 65535, "command": 65535, "frame": 255}
_NUMBERS = ("p1", "p2", "p3", "p4", "alt_m")


def to_json(value: object) -> str:
    """One line of strict JSON."""
    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:
        return json.dumps(strict(value), allow_nan=False)


def strict(value: Any) -> Any:
    """Replace numbers that JSON lacks: NaN ("not given") becomes null, infinity a text."""
    if isinstance(value, dict):
        return {key: strict(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [strict(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def plain(thing: Any) -> Json:
    """Turn a dataclass into plain data, recursively. asdict() copies everything and takes five times as long."""
    names, values = _layout(type(thing))  # type: ignore[arg-type]  # a class can be hashed
    return dict(zip(names, map(_plain_value, values(thing)), strict=True))


def _plain_value(value: Any) -> Any:
    if type(value) in _SCALARS:
        return value
    if isinstance(value, tuple):
        return [_plain_value(each) for each in value]
    return plain(value) if is_dataclass(value) else value


@cache
def _layout(kind: Hashable) -> tuple[tuple[str, ...], Callable[[Any], tuple[Any, ...]]]:
    names = tuple(each.name for each in fields(kind))  # type: ignore[arg-type]
    return names, attrgetter(*names)


def printable(value: Any) -> Any:
    """Make plain data safe to print: a daemon or store that was taken over may hold anything.

    Texts lose what is not printable. A whole number that a reader of JSON cannot hold becomes null.
    """
    if isinstance(value, dict):
        return {printable(key): printable(each) for key, each in value.items()}
    if isinstance(value, list):
        return [printable(each) for each in value]
    if isinstance(value, int) and abs(value) > MOST_WHOLE:
        return None
    return plain_text(value) if isinstance(value, str) else value


def mission_items(data: object) -> list[MissionItem]:
    """Read the items of a list from plain data. ValueError gives the reason."""
    if not isinstance(data, list):
        raise ValueError("items must be a list")
    return [_item(entry) for entry in data]


def mission_findings(data: object) -> list[Finding]:
    """The findings in a verdict or a stored mission, from any release: older releases lack `news`.

    Fields of another type count as missing, and the texts are safe to print.
    """
    return [_finding(entry) for entry in data if isinstance(entry, dict)] if isinstance(data, list) else []


def _finding(data: Json) -> Finding:
    def given(name: str, *types: type) -> Any:
        value = strict(data.get(name))
        return printable(value) if isinstance(value, types) and not isinstance(value, bool) else None

    was, becomes = given("was", str, int, float), given("becomes", str, int, float)
    news = next((each for each in News if each == data.get("news")), News.NOTICE)
    why = given("why", str) or ""
    return Finding(given("seq", int), given("field", str) or "", was, becomes, why, given("command", int), news)


def correction_texts(findings: Iterable[Finding]) -> list[str]:
    """The findings as lines for the pilot, without filled-in defaults."""
    return [finding.text() for finding in without_defaults(findings)]


def verdict_data(verdict: Verdict[Any]) -> Json:
    """The rules' verdict on a list. `count` and `checksum` identify the records that it becomes."""
    identity = identify(verdict.records)
    return {
        "result": verdict.result.name,
        "ack": f"MAV_MISSION_{verdict.ack.name}",
        "items": list(map(plain, verdict.items)),
        "sent_seqs": list(verdict.sent_seqs),
        "records": [record.pack().hex() for record in verdict.records],
        "count": identity.count,
        "checksum": f"{identity.checksum:08x}",
        "findings": list(map(plain, verdict.findings)),
        "flight": ", ".join(verdict.flight),
        "path": list(map(plain, verdict.path)),
        "assumed": ", ".join(verdict.assumed),
    }


def whole_number(data: Json, key: str, least: int, most: int) -> int:
    """data[key]. Raises ValueError if it is not a whole number from `least` to `most`."""
    value = data.get(key)
    if not _is_whole(value) or not least <= value <= most:
        raise ValueError(f"{key} must be a whole number from {least} to {most}")
    return int(value)


def _item(entry: object) -> MissionItem:
    if not isinstance(entry, dict):
        raise ValueError("an item must be an object")
    seq, command, frame = (whole_number(entry, key, 0, most) for key, most in _WHOLE.items())
    p1, p2, p3, p4, alt_m = (_number(entry, key) for key in _NUMBERS)
    return MissionItem(seq, command, frame, p1, p2, p3, p4, _place(entry, "lat_e7"), _place(entry, "lon_e7"), alt_m)


def _number(entry: Json, key: str) -> float:
    value = entry.get(key)
    try:
        return math.nan if value is None else float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{key} must be a number, or null if it is not given") from None


def _place(entry: Json, key: str) -> int | None:
    value = entry.get(key)
    if value is None or (_is_whole(value) and math.isfinite(_number(entry, key))):
        return None if value is None else int(value)
    raise ValueError(f"{key} must be degrees * 1e7, or null if it is not given")


def _is_whole(value: object) -> TypeGuard[int]:
    """True for an int, so for a Command too, but not for a bool."""
    return isinstance(value, int) and not isinstance(value, bool)
