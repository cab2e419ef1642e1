# SPDX-License-Identifier: GPL-3.0-or-later
"""Logs to standard error: coloured and short on a terminal, one JSON object a line elsewhere.

For journald each line begins with the priority (sd-daemon(3)).
"""

import logging
import os
import select
import sys
import time
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

import structlog
from structlog.typing import EventDict, Processor

from payloads.mission_data import printable

#: The levels in ascending order, with their syslog priorities.
_PRIORITIES = {"debug": 7, "info": 6, "warning": 4, "error": 3}
_WEIGHTS = {level: weight for weight, level in enumerate(_PRIORITIES)}
#: Beyond this rate the same event is suppressed and counted.
_MOST, _WITHIN_S = 20, 10.0
#: Lines kept for the status page, and characters of one.
_KEPT, _MOST_TEXT = 300, 1000

_log = structlog.get_logger()


#: What an event is about, by the first part of the name.
_SUBJECTS = {
    "config": "Settings",
    "daemon": "Bridge",
    "fc": "Flight controller",
    "gcs": "Ground station",
    "store": "Mission store",
    "tlog": "Telemetry log",
    "uart": "UART recording",
    "vehicle": "Craft",
    "web": "Status page",
}
_UNITS = {"baud": "baud", "s": "s", "m": "m", "mb": "MB"}
#: Facts without names, in this order before the others.
_PLAIN_FACTS = ("text", "detail", "why", "what")
_UNSAID = (*_PLAIN_FACTS, "event", "level", "exception")


class LogLine(NamedTuple):
    """`at_s`: seconds since 1970. `text`: the event as a sentence, shortened."""

    at_s: float
    level: str
    text: str


def sentence(event: Mapping[str, object]) -> str:
    """An event for a person.

    >>> sentence({"event": "fc.lost", "why": "silence", "speed_baud": 9600})
    'Flight controller lost: silence, speed 9600 baud'
    """
    about, _, happened = str(event["event"]).partition(".")
    facts = [str(event[name]) for name in _PLAIN_FACTS if event.get(name)]
    for name, value in event.items():
        if name not in _UNSAID and value not in (None, "", [], {}):
            words, _, unit = name.rpartition("_")
            shown = ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            facts.append(f"{words} {shown} {_UNITS[unit]}" if unit in _UNITS and words else f"{name} {shown}")
    subject = f"{_SUBJECTS.get(about, about.capitalize())} {happened}".strip()
    return f"{subject}{': ' if facts else ''}{', '.join(facts)}".replace("_", " ")


class _StandardError:
    """Prints a line, or drops it: a full disk or pipe must not stop the bridge."""

    def __init__(self) -> None:
        self._is_broken_off = False

    def msg(self, line: str) -> None:
        if sys.stderr is None:  # closed by the parent process, as for old daemons
            return
        start = "\n" if self._is_broken_off else ""
        rest = f"{start}{line}\n".encode(errors="backslashreplace")
        with suppress(OSError):
            descriptor = sys.stderr.fileno()
            # A pipe that is writable takes this much without blocking.
            while rest and select.select([], [descriptor], [], 0)[1]:
                self._is_broken_off = True
                rest = rest[os.write(descriptor, rest[: select.PIPE_BUF]) :]
        self._is_broken_off = self._is_broken_off and bool(rest)

    debug = info = warning = error = msg


class _Limits:
    """Keeps repeated events from flooding the log. The number of suppressed ones is logged with the next line."""

    def __init__(self) -> None:
        #: Events of less weight are dropped. It may change at run time.
        self.level = "info"
        self._seen: dict[str, tuple[float, int]] = {}

    def __call__(self, _logger: object, method: str, event: EventDict) -> EventDict:
        if _WEIGHTS[method] < _WEIGHTS[self.level]:
            raise structlog.DropEvent
        now = time.monotonic()
        over = [(name, count) for name, (began, count) in self._seen.items() if now >= began + _WITHIN_S]
        for name, _ in over:
            del self._seen[name]
        for name, count in over:
            if count > _MOST:
                _log.warning("log.left_out", of=name, times=count - _MOST)
        began, count = self._seen.get(event["event"], (now, 0))
        self._seen[event["event"]] = began, count + 1
        if count >= _MOST:
            raise structlog.DropEvent
        return event


class _Recent:
    """Keeps the latest lines for the status page: the daemon may not read the journal."""

    def __init__(self) -> None:
        self.count = 0
        self.lines: deque[LogLine] = deque(maxlen=_KEPT)

    def __call__(self, _logger: object, method: str, event: EventDict) -> EventDict:
        self.count += 1
        self.lines.append(LogLine(round(time.time(), 1), method, str(printable(sentence(event)))[:_MOST_TEXT]))
        return event


_render_json = structlog.processors.JSONRenderer()


def _journal_line(logger: object, method: str, event: EventDict) -> str:
    """JSON after the priority, without the time: journald adds its own."""
    return f"<{_PRIORITIES[method]}>{_render_json(logger, method, event)!s}"


def _safe(_logger: object, _method: str, event: EventDict) -> EventDict:
    """Without escape sequences: a terminal would obey those in the message of a library or of the system."""
    return {key: value if key == "exception" else printable(value) for key, value in event.items()}


_limits = _Limits()
_recent = _Recent()


class _FromLibraries(logging.Handler):
    """Routes the logs of libraries (mainly asyncio) the same way. Their own handler would block on a full pipe."""

    def emit(self, record: logging.LogRecord) -> None:
        level = _log.error if record.levelno >= logging.ERROR else _log.warning
        level("library.log", logger=record.name, what=record.getMessage(), exc_info=record.exc_info)


def warn_once(known: set[str], event: str, /, **facts: object) -> None:
    """Log a problem that lasts: as a warning at first, then at debug level while `known` has the event."""
    level = _log.debug if event in known else _log.warning
    known.add(event)
    level(event, **facts)


def recent_lines(after: int) -> tuple[int, list[LogLine]]:
    """The number of lines logged so far, and the latest of those after the first `after` lines."""
    count = min(max(_recent.count - after, 0), len(_recent.lines))
    return _recent.count, [*_recent.lines][len(_recent.lines) - count :]


def set_up_logging(level: str) -> None:
    _limits.level = level
    output = _StandardError()
    logging.basicConfig(handlers=[_FromLibraries()], level=logging.WARNING, force=True)
    structlog.configure(
        processors=[
            _limits,
            structlog.processors.add_log_level,
            structlog.processors.format_exc_info,
            _recent,
            *_output(),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(0),
        logger_factory=lambda *_: output,
        cache_logger_on_first_use=True,
    )


def _output() -> list[Processor]:
    if os.environ.get("JOURNAL_STREAM"):
        return [_journal_line]
    if sys.stderr is not None and sys.stderr.isatty():
        return [structlog.processors.TimeStamper(fmt="%H:%M:%S", utc=False), _safe, structlog.dev.ConsoleRenderer()]
    return [structlog.processors.TimeStamper(fmt="iso", utc=True), structlog.processors.JSONRenderer()]
