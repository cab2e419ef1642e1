# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of `history?_time=[..]` that is read from telemetry logs: texts, arming and positions.

Blocks for seconds: not for an event loop.
"""

import os
import time
from bisect import bisect_left
from collections.abc import Container, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from itertools import pairwise
from math import inf
from pathlib import Path

from protocols.mavlink.codec import MavlinkDecoder
from protocols.mavlink.dialect import Message, messages
from protocols.tlog import read_tlog
from service.daemon.mission_data import Json
from service.recording.tlog_folder import is_log_name
from service.zenoh_link.time_range import TimeRange

#: Every log has heartbeats, so a search soon finds a record.
_SEARCHED = (
    messages.MAVLINK_MSG_ID_HEARTBEAT,
    messages.MAVLINK_MSG_ID_STATUSTEXT,
    messages.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
)
#: A caller waits 10 s by default. Later logs are read first.
_MAX_READING_S = 5.0
#: A record has at most 300 bytes.
_STEP = 4096
#: Long enough for a heartbeat, which shows if the craft was armed before the range.
_BEFORE_S = 3.0
#: A flight controller reports its position five times a second.
_POSITION_INTERVAL_S = 1.0
#: A log that is full is followed by another one within a second or two.
_SAME_RUN_S = 3.0
#: The event loop's thread gets its turn after each slice.
_SLICE_S, _PAUSE_S = 0.002, 0.001
_NAME_FORMAT, _NAME_LENGTH = "%Y-%m-%d %H-%M-%S", 19


@dataclass(slots=True)
class LoggedPast:
    """Both lists oldest first. `from_s`: the beginning of the oldest log that was read; None: none was."""

    events: list[Json] = field(default_factory=list)
    positions: list[Json] = field(default_factory=list)
    from_s: float | None = None


def log_stamps(folder: Path) -> frozenset[str]:
    """The times in the names of the present logs. A log keeps its time when it is renamed as a flight's."""
    return frozenset(log.path.name[:_NAME_LENGTH] for log in _logs(folder))


def read_logged_past(
    folder: Path, wanted: TimeRange, max_positions: int, earlier: Container[str] = (), kept_from_s: float = inf
) -> LoggedPast:
    """Search the logs of a time range. OSError if they cannot be read.

    `earlier`: the logs of previous runs (log_stamps). The others yield only events before `kept_from_s`: the caller
    has the later ones.
    """
    past = LoggedPast()
    deadline = time.monotonic() + _MAX_READING_S
    for log in reversed(_logs(folder)):
        if log.begun_s > wanted.end_s or log.ended_s < wanted.start_s:
            continue
        is_own = log.path.name[:_NAME_LENGTH] not in earlier
        if is_own and not max_positions and wanted.start_s >= kept_from_s:
            continue
        if time.monotonic() > deadline:
            break
        with suppress(FileNotFoundError):  # already removed, or renamed because a flight began
            found = _read(log, wanted, max_positions)
            past.events[:0] = [event for event in found.events if not is_own or event["time_s"] < kept_from_s]
            past.positions[:0] = found.positions
            past.from_s = log.begun_s
    past.positions = _thinned(past.positions, max_positions)
    return past


@dataclass(frozen=True, slots=True)
class _Log:
    """Times are unix seconds. is_continued: it follows the previous log without a pause, maybe in flight."""

    begun_s: float
    ended_s: float
    path: Path
    is_continued: bool = False


def _logs(folder: Path) -> list[_Log]:
    if not folder.is_dir():
        return []
    found = []
    for entry in os.scandir(folder):
        begun_s = _begun_s(entry.name) if is_log_name(entry.name) else None
        if begun_s is not None:
            with suppress(FileNotFoundError):  # as in read_logged_past
                found.append(_Log(begun_s, entry.stat().st_mtime, Path(entry.path)))
    found.sort(key=lambda log: log.begun_s)
    follows = [later.begun_s - log.ended_s < _SAME_RUN_S for log, later in pairwise(found)]
    return [replace(log, is_continued=same) for log, same in zip(found, (False, *follows), strict=False)]


def _begun_s(name: str) -> float | None:
    """The time in a log's name, which is in UTC; None if there is no such time."""
    try:
        return datetime.strptime(name[:_NAME_LENGTH], _NAME_FORMAT).replace(tzinfo=UTC).timestamp()
    except ValueError:
        return None


def _read(log: _Log, wanted: TimeRange, max_positions: int) -> LoggedPast:
    found = LoggedPast()
    # Without a ground station a log begins with the arming.
    armed = None if log.is_continued else False
    next_position_s = -inf
    for time_s, message in _messages(log.path.read_bytes(), wanted.start_s - _BEFORE_S):
        is_wanted = time_s in wanted
        if message.get_type() == "HEARTBEAT":
            was_armed, armed = armed, bool(message.base_mode & messages.MAV_MODE_FLAG_SAFETY_ARMED)
            if is_wanted and was_armed is not None and armed != was_armed:
                found.events.append(_event(time_s, "info", "vehicle.armed" if armed else "vehicle.disarmed", {}))
        elif is_wanted and message.get_type() == "STATUSTEXT":
            found.events.append(_event(time_s, "debug", "gcs.text", {"text": message.text}))
        elif is_wanted and max_positions and time_s >= next_position_s:
            found.positions.append(_position(time_s, message))
            next_position_s = time_s + _POSITION_INTERVAL_S
    return found


def _messages(log: bytes, start_s: float) -> Iterator[tuple[float, Message]]:
    """The vehicle's messages from about `start_s` on, with pauses."""
    decoder = MavlinkDecoder()
    first = bisect_left(range(len(log) // _STEP), start_s, key=lambda step: _time_s(log, step * _STEP))
    pause_at = time.monotonic() + _SLICE_S
    for record in read_tlog(log[max(first - 1, 0) * _STEP :], _SEARCHED):
        if record.frame.compid == messages.MAV_COMP_ID_AUTOPILOT1 and (message := decoder.decode(record.frame)):
            yield record.at_us / 1e6, message
        if time.monotonic() > pause_at:
            time.sleep(_PAUSE_S)
            pause_at = time.monotonic() + _SLICE_S


def _time_s(log: bytes, place: int) -> float:
    """The time of the first whole record near `place`; infinite in a damaged part, so that the search starts before."""
    return next((record.at_us / 1e6 for record in read_tlog(log[place : place + _STEP])), inf)


def _event(time_s: float, level: str, event: str, facts: Json) -> Json:
    """As published, but without a number: those count from the daemon's start."""
    return {"v": 1, "seq": None, "time_s": round(time_s, 3), "level": level, "event": event, "facts": facts}


def _position(time_s: float, message: Message) -> Json:
    return {
        "time_s": round(time_s, 3),
        "lat_deg": message.lat / 1e7,
        "lon_deg": message.lon / 1e7,
        "altitude_m": message.alt / 1000,
        "height_m": message.relative_alt / 1000,
    }


def _thinned(positions: list[Json], most: int) -> list[Json]:
    """Every n-th position, with the newest one."""
    step = -(-len(positions) // most) if positions else 1
    return positions[(len(positions) - 1) % step :: step]
