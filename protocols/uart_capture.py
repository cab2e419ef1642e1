"""UART captures (.uart): what was read from and written to a flight controller's port, when, and at which speed.

One JSON object a line, each line for itself, so a capture may be appended to, cut with head and tail, and torn:

    {"naze-bridge-uart":1,"started":"2026-11-21T06:33:06Z"}  the daemon began to record
    {"t":0.010204,"baud":115200,"open":""}                   the port was opened
    {"t":0.113541,"baud":115200,"write":"244d3c006464"}      bytes were given to the port, in hex
    {"t":0.117002,"baud":115200,"read":"244d3e0764..."}      bytes were read from it
    {"t":9.402113,"baud":115200,"close":"unplugged"}         the port was closed or lost, and why

`t`: seconds since the daemon began. `baud`: the port's speed; null where it has none (TCP).
"""

import json
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeGuard

_MARK = "naze-bridge-uart"
_VERSION = 1
#: What passes between the last line of one recording and the first of the next in the same file.
_PAUSE_S = 1.0
#: Ten years: what says more is damaged.
_LONGEST_S = 3e8


class UartDeed(Enum):
    """What happened at the port."""

    OPEN = "open"
    READ = "read"
    WRITE = "write"
    CLOSE = "close"


_WITH_DATA = frozenset({UartDeed.READ, UartDeed.WRITE})


@dataclass(frozen=True, slots=True)
class UartEvent:
    """One line. `speed` in baud, None where the line has none; `text`: why it was closed."""

    at: float
    speed: int | None
    deed: UartDeed
    data: bytes = b""
    text: str = ""


def capture_header(started: str) -> bytes:
    """Return the line with which a recording begins. `started`: time in UTC, for people."""
    return f'{{"{_MARK}":{_VERSION},"started":{json.dumps(started)}}}\n'.encode()


def capture_line(event: UartEvent) -> bytes:
    """Return an event's line."""
    speed = "null" if event.speed is None else event.speed
    # Hex needs no escapes, and these lines are many.
    content = f'"{event.data.hex()}"' if event.deed in _WITH_DATA else json.dumps(event.text)
    return f'{{"t":{event.at:.6f},"baud":{speed},"{event.deed.value}":{content}}}\n'.encode()


def is_capture(beginning: bytes) -> bool:
    """Tell whether a file that begins so is a capture that may be appended to."""
    return beginning.startswith(f'{{"{_MARK}":'.encode())


def read_capture(data: bytes) -> list[UartEvent]:
    """Return the events of all recordings in a file, in order, the first at 0. What is no line of ours is skipped.

    Between two recordings a pause takes the place of the time that nobody knows; a port that was not closed when
    the first one ended (the daemon was killed) is closed there.
    """
    events: list[UartEvent] = []
    began_at, first_at = 0.0, None
    for line in data.split(b"\n"):
        if is_capture(line):
            if events:
                _end(events)
                began_at = events[-1].at + _PAUSE_S
            first_at = None
        elif (event := _parse(line)) is not None:
            if first_at is None:
                first_at = event.at
            # Time never runs back, whatever is in the file.
            earliest = events[-1].at if events else 0.0
            events.append(replace(event, at=max(began_at + event.at - first_at, earliest)))
    return events


def _end(events: list[UartEvent]) -> None:
    last = events[-1]
    if last.deed is not UartDeed.CLOSE:
        events.append(UartEvent(last.at, last.speed, UartDeed.CLOSE, text="the recording ended"))


def _parse(line: bytes) -> UartEvent | None:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    at, speed = found.get("t"), found.get("baud")
    deed = next((deed for deed in UartDeed if deed.value in found), None)
    if deed is None or not _is_time(at) or not _is_speed(speed) or not isinstance(found[deed.value], str):
        return None
    if deed not in _WITH_DATA:
        return UartEvent(at, speed, deed, text=found[deed.value])
    try:
        return UartEvent(at, speed, deed, bytes.fromhex(found[deed.value]))
    except ValueError:
        return None


def _is_time(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and 0 <= value < _LONGEST_S


def _is_speed(value: object) -> TypeGuard[int | None]:
    return value is None or (isinstance(value, int) and value > 0)
