# SPDX-License-Identifier: GPL-3.0-or-later
"""zenoh's time ranges, as in `history?_time=[now(-1h)..now()]`. Sans-IO.

Not its form with a duration, `[now(-1h);30m]`: in a query a semicolon ends the parameter (zenoh 1.10).
"""

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf

_UNITS_S = {"": 1, "u": 1e-6, "ms": 1e-3, "s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}
_RANGE = re.compile(r"[\[\]](?P<start>[^\[\]]*?)\.\.(?P<end>[^\[\]]*)[\[\]]")
_NOW = re.compile(r"now\((?P<offset>[^()]*)\)")
_DURATION = re.compile(r"(?P<number>-?\d+(?:\.\d+)?)(?P<unit>u|ms|s|m|h|d|w|)")


@dataclass(frozen=True, slots=True)
class TimeRange:
    """Seconds since 1970 (UTC); zenoh's open ends are treated as closed ones."""

    start_s: float = -inf
    end_s: float = inf

    def __contains__(self, time_s: float) -> bool:
        return self.start_s <= time_s <= self.end_s


def parse_time_range(text: str, now_s: float) -> TimeRange:
    """Read a range; ValueError explains the form."""
    match = _RANGE.fullmatch(text.strip())
    if match is None:
        raise _wrong(text)
    return TimeRange(_time(match["start"], now_s, -inf), _time(match["end"], now_s, inf))


def _time(text: str, now_s: float, default: float) -> float:
    text = text.strip()
    if not text:
        return default
    if match := _NOW.fullmatch(text):
        return now_s + (_duration(match["offset"]) if match["offset"] else 0)
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise _wrong(text) from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def _duration(text: str) -> float:
    match = _DURATION.fullmatch(text.strip())
    if match is None:
        raise _wrong(text)
    return float(match["number"]) * _UNITS_S[match["unit"]]


def _wrong(text: str) -> ValueError:
    return ValueError(
        f"{text[:40]!r} is not a time range: write one like [now(-1h)..now()] or [2026-05-01T10:00Z..2026-05-01T10:30Z]"
    )
