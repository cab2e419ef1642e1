# SPDX-License-Identifier: GPL-3.0-or-later
"""UART captures (.uart): the bytes read from and written to a flight controller's port, with time and speed.

One independent JSON object per line, so a capture can be appended to, cut with head and tail, or truncated by a crash:

    {"naze-bridge-uart":1,"started":"2026-11-21T06:33:06Z"}  the daemon began to record
    {"t":0.010204,"baud":115200,"open":""}                   the port was opened
    {"t":0.113541,"baud":115200,"write":"244d3c006464"}      bytes were given to the port, in hex
    {"t":0.117002,"baud":115200,"read":"244d3e0764..."}      bytes were read from it
    {"t":9.402113,"baud":115200,"close":"unplugged"}         the port was closed or lost, and why

`t`: seconds since the daemon began. `baud`: the port's speed; null where it has none (TCP).
"""

import json
import re
from binascii import unhexlify
from dataclasses import dataclass
from enum import Enum

from protocols.plain_text import plain_text

_MARK = "naze-bridge-uart"
_VERSION = 1
#: The assumed time between two recordings in the same file.
_PAUSE_S = 1.0


class UartAction(Enum):
    """An event at the port."""

    OPEN = "open"
    READ = "read"
    WRITE = "write"
    CLOSE = "close"


_ACTIONS = {action.value.encode(): action for action in UartAction}
#: A complete line as written here: there may be millions, and matching costs a tenth of parsing JSON. A time above ten
#: years is damage.
_LINE = re.compile(
    rb'^(?:(?P<mark>\{"' + _MARK.encode() + rb'":).*'
    rb'|\{"t":(?P<t>\d{1,9}(?:\.\d{1,6})?),"baud":(?P<baud>null|[1-9]\d{0,8}),'
    rb'(?:"(?P<bytes>read|write)":"(?P<hex>(?:[0-9a-f]{2})*)"|"(?P<other>open|close)":(?P<text>".*"))\})$',
    re.MULTILINE,
)
_WITH_DATA = frozenset({UartAction.READ, UartAction.WRITE})


@dataclass(frozen=True, slots=True)
class UartEvent:
    """One line. `speed` in baud, None where the line has none; `text`: why it was closed."""

    at: float
    speed: int | None
    action: UartAction
    data: bytes = b""
    text: str = ""


def capture_header(started: str) -> bytes:
    """The first line of a recording. `started`: time in UTC, for people."""
    return f'{{"{_MARK}":{_VERSION},"started":{json.dumps(started)}}}\n'.encode()


def capture_line(event: UartEvent) -> bytes:
    speed = "null" if event.speed is None else event.speed
    # Hex needs no escapes, and there are many such lines.
    content = f'"{event.data.hex()}"' if event.action in _WITH_DATA else json.dumps(event.text)
    return f'{{"t":{event.at:.6f},"baud":{speed},"{event.action.value}":{content}}}\n'.encode()


def is_capture(beginning: bytes) -> bool:
    """True if a file that starts with these bytes is a capture and can be appended to."""
    return beginning.startswith(f'{{"{_MARK}":'.encode())


def read_capture(data: bytes) -> list[UartEvent]:
    """The events of all recordings in a file, in order, the first at time 0. Other lines are skipped.

    Between two recordings a pause replaces the unknown time; a port that was not closed when
    the first one ended (the daemon was killed) is closed there.
    """
    events: list[UartEvent] = []
    began_at, first_at = 0.0, None
    for line in _LINE.finditer(data):
        if line["mark"]:
            if events:
                last = events[-1]
                if last.action is not UartAction.CLOSE:
                    events.append(UartEvent(last.at, last.speed, UartAction.CLOSE, text="the recording ended"))
                began_at = events[-1].at + _PAUSE_S
            first_at = None
            continue
        at = float(line["t"])
        if first_at is None:
            first_at = at
        # Time never runs backwards, even in a damaged file.
        earliest = events[-1].at if events else 0.0
        event = _event(line, max(began_at + at - first_at, earliest))
        if event is not None:
            events.append(event)
    return events


def _event(line: re.Match[bytes], at: float) -> UartEvent | None:
    speed = None if line["baud"] == b"null" else int(line["baud"])
    if line["hex"] is not None:
        return UartEvent(at, speed, _ACTIONS[line["bytes"]], unhexlify(line["hex"]))
    try:
        return UartEvent(at, speed, _ACTIONS[line["other"]], text=plain_text(json.loads(line["text"])))
    except ValueError:
        return None
