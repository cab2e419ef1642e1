# SPDX-License-Identifier: GPL-3.0-or-later
"""Logs why no session is connected: zenoh keeps trying without a message."""

import asyncio
import threading
from collections.abc import Callable

import structlog

from service.machine.threads import post

#: The interval of diagnoses. zenoh tries again at least every 4 s.
_INTERVAL_S = 5.0

_log = structlog.get_logger()


class OutageLog:
    """Logs each new reason once, if two diagnoses in a row find it and the bridge is still alone.

    A single diagnosis may meet a router that has just returned, before zenoh has joined it. `diagnose` may block: it is
    called on a thread, because an endpoint that drops all packets takes seconds to time out.
    """

    def __init__(self, diagnose: Callable[[], str]) -> None:
        self._diagnose = diagnose
        self._loop = asyncio.get_running_loop()
        self._next_at = self._loop.time() + _INTERVAL_S
        self._is_alone = self._is_running = False
        self._found = ""
        self._logged = ""

    def look(self, is_alone: bool, now: float) -> None:
        """Start a diagnosis if it is due; called every second. `is_alone`: no session is connected."""
        self._is_alone = is_alone
        if not is_alone:
            self._found = ""
            self._next_at = now + _INTERVAL_S
        elif now >= self._next_at and not self._is_running:
            self._next_at = now + _INTERVAL_S
            self._is_running = True
            threading.Thread(target=self._run, name="zenoh why", daemon=True).start()

    def _run(self) -> None:
        post(self._loop, self._diagnosed, self._diagnose())

    def _diagnosed(self, why: str) -> None:
        self._is_running = False
        before, self._found = self._found, why
        if self._is_alone and why == before and why != self._logged:
            self._logged = why
            _log.warning("zenoh.alone", why=why)
