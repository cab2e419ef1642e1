# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of `history?_time=[..]` that is read from telemetry logs: texts, arming and positions.

Blocks for seconds: not for an event loop.
"""

import os
import time
from bisect import bisect_left
from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from itertools import pairwise
from math import inf
from pathlib import Path

from payloads.mission_data import Json
from protocols.mavlink.codec import decode
from protocols.mavlink.dialect import Message, messages
from protocols.tlog import STAMP_SIZE, read_tlog
from service.recording.tlog_folder import is_log_name
from service.zenoh_link.time_range import TimeRange

#: Every log has heartbeats, so a search soon finds a record.
_SEARCHED = (
    messages.MAVLINK_MSG_ID_HEARTBEAT,
    messages.MAVLINK_MSG_ID_STATUSTEXT,
    messages.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
)
#: A record has at most 300 bytes.
_STEP = 4096
#: Bytes between two checks of the time: half a second on a Pi Zero 2 W.
_PIECE = 1 << 18
#: Bytes read before a piece, for a heartbeat that shows if the craft was armed where the piece begins.
_LEAD = 1 << 15
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
    """Both lists oldest first. `from_s`: the time from which the logs were read; None: no log was."""

    events: list[Json] = field(default_factory=list)
    positions: list[Json] = field(default_factory=list)
    from_s: float | None = None


def log_stamps(folder: Path) -> frozenset[str]:
    """The times in the names of the present logs. A log keeps its time when it is renamed as a flight's."""
    return frozenset(log.path.name[:_NAME_LENGTH] for log in _logs(folder))


def read_logged_past(
    folder: Path,
    wanted: TimeRange,
    max_positions: int,
    earlier: Container[str] = (),
    kept_from_s: float = inf,
    is_enough: Callable[[], bool] = lambda: False,
) -> LoggedPast:
    """Search the logs of a time range, the newest records first, until `is_enough`. OSError if they cannot be read.

    `earlier`: the logs of previous runs (log_stamps). The others yield only events before `kept_from_s`: the caller
    has the later ones.
    """
    past = LoggedPast()
    for found in _newest_first(folder, wanted, max_positions, earlier, kept_from_s):
        past.events[:0] = found.events
        past.positions[:0] = found.positions
        past.from_s = found.from_s
        if is_enough():
            break
    past.positions = _thinned(past.positions, max_positions)
    return past


def _newest_first(
    folder: Path, wanted: TimeRange, max_positions: int, earlier: Container[str], kept_from_s: float
) -> Iterator[LoggedPast]:
    """The logs in pieces."""
    for log in reversed(_logs(folder)):
        if log.begun_s > wanted.end_s or log.ended_s < wanted.start_s:
            continue
        is_own = log.path.name[:_NAME_LENGTH] not in earlier
        if is_own and not max_positions and wanted.start_s >= kept_from_s:
            continue
        with suppress(FileNotFoundError):  # already removed, or renamed because a flight began
            for found in _pieces(log, wanted, max_positions):
                if is_own:
                    found.events = [event for event in found.events if event["time_s"] < kept_from_s]
                yield found


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


def _pieces(log: _Log, wanted: TimeRange, max_positions: int) -> Iterator[LoggedPast]:
    """A log in pieces of whole records, from its end to about the start of the range."""
    data = log.path.read_bytes()
    before_s = wanted.start_s - _BEFORE_S
    step = bisect_left(range(len(data) // _STEP), before_s, key=lambda step: _record_near(data, step * _STEP)[1])
    first, end = max(step - 1, 0) * _STEP, len(data)
    for place in reversed(range(first, end, _PIECE)):
        start, start_s = (first, log.begun_s) if place == first else _record_near(data, place)
        if start_s < inf:
            found = _read(log, data, slice(start, end), wanted, max_positions)
            found.from_s = start_s
            yield found
            end = start


def _read(log: _Log, data: bytes, piece: slice, wanted: TimeRange, max_positions: int) -> LoggedPast:
    found = LoggedPast()
    lead = slice(max(piece.start - _LEAD, 0), piece.start)
    # Without a ground station a log begins with the arming.
    armed = None if log.is_continued or lead.start else False
    for _, message in _messages(data[lead]):
        if message.get_type() == "HEARTBEAT":
            armed = _is_armed(message)
    next_position_s = -inf
    for time_s, message in _messages(data[piece]):
        is_wanted = time_s in wanted
        if message.get_type() == "HEARTBEAT":
            was_armed, armed = armed, _is_armed(message)
            if is_wanted and was_armed is not None and armed != was_armed:
                found.events.append(_event(time_s, "info", "vehicle.armed" if armed else "vehicle.disarmed", {}))
        elif is_wanted and message.get_type() == "STATUSTEXT":
            found.events.append(_event(time_s, "debug", "gcs.text", {"text": message.text}))
        elif is_wanted and max_positions and time_s >= next_position_s:
            found.positions.append(_position(time_s, message))
            next_position_s = time_s + _POSITION_INTERVAL_S
    return found


def _is_armed(heartbeat: Message) -> bool:
    return bool(heartbeat.base_mode & messages.MAV_MODE_FLAG_SAFETY_ARMED)


def _messages(records: bytes) -> Iterator[tuple[float, Message]]:
    """The vehicle's messages, with pauses."""
    pause_at = time.monotonic() + _SLICE_S
    for record in read_tlog(records, _SEARCHED):
        frame = record.frame
        is_ours = frame.compid == messages.MAV_COMP_ID_AUTOPILOT1
        if is_ours and (message := decode(frame.msgid, frame.payload)):
            yield record.at_us / 1e6, message
        if time.monotonic() > pause_at:
            time.sleep(_PAUSE_S)
            pause_at = time.monotonic() + _SLICE_S


def _record_near(data: bytes, place: int) -> tuple[int, float]:
    """The place and time of the first whole record from `place` on.

    In a damaged part the time is infinite, so that a search starts before it.
    """
    record = next(read_tlog(data[place : place + _STEP]), None)
    if record is None:
        return place, inf
    return data.index(record.frame.raw, place) - STAMP_SIZE, record.at_us / 1e6


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
