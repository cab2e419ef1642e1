# SPDX-License-Identifier: GPL-3.0-or-later
"""Logs why no session is connected: zenoh keeps trying without a message."""

import asyncio
from collections.abc import Callable

import structlog

from service.machine.threads import BackgroundThread

#: The interval of diagnoses. zenoh tries again at least every 4 s.
_INTERVAL_S = 5.0

_log = structlog.get_logger()


async def log_outages(diagnose: Callable[[], str], is_alone: Callable[[], bool]) -> None:
    """Log each new reason once, if two diagnoses in a row find it and the bridge is still alone; never returns.

    A single diagnosis may meet a router that has just returned, before zenoh has joined it. `diagnose` may block: it is
    called on a thread, because an endpoint that drops all packets takes seconds to time out.
    """
    thread = BackgroundThread("zenoh why")
    found = logged = ""
    try:
        while True:
            await asyncio.sleep(_INTERVAL_S)
            before, found = found, await thread.ask(diagnose) if is_alone() else ""
            if found and found == before != logged and is_alone():
                logged = found
                _log.warning("zenoh.alone", why=found)
    finally:
        thread.close(0)
