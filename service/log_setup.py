"""Logs to standard error: coloured and short on a terminal, one JSON object a line elsewhere."""

import sys
from contextlib import suppress

import structlog


class _StandardError:
    """Prints a line, or loses it: a full disk behind a log must not stop the bridge."""

    def msg(self, line: str) -> None:
        with suppress(OSError):
            print(line, file=sys.stderr, flush=True)  # noqa: T201

    debug = info = warning = error = msg


def set_up_logging(level: int) -> None:
    """Configure structlog for this process: events from `level` (of the logging module) on are shown."""
    on_terminal = sys.stderr.isatty()
    renderer: structlog.typing.Processor = (
        structlog.dev.ConsoleRenderer() if on_terminal else structlog.processors.JSONRenderer()
    )
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="%H:%M:%S" if on_terminal else "iso", utc=not on_terminal),
            structlog.processors.format_exc_info,
            renderer,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        logger_factory=lambda *_: _StandardError(),
        cache_logger_on_first_use=True,
    )
