# SPDX-License-Identifier: GPL-3.0-or-later
"""The life of a daemon from the start to a signal, reported to systemd."""

import asyncio
import signal
from contextlib import suppress

import structlog

from service.daemon.daemon import Daemon
from service.machine.notify import Notifier

#: The number of watchdog messages per watchdog timeout.
_FEEDS = 3

_log = structlog.get_logger()


async def run_until_signal(daemon: Daemon, notifier: Notifier) -> None:
    """Run the daemon until SIGINT or SIGTERM. A second signal does not wait for a transfer."""
    loop = asyncio.get_running_loop()
    running = loop.create_task(daemon.run())
    stopping: asyncio.Task[None] | None = None

    async def stop() -> None:
        try:
            await daemon.finish()
        finally:
            running.cancel()

    def signalled(number: signal.Signals) -> None:
        nonlocal stopping
        _log.info("daemon.stopping", signal=number.name)
        if stopping is None:
            notifier.stopping()
            stopping = loop.create_task(stop())
        else:
            running.cancel()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, signalled, number)
    reporting = loop.create_task(_report(daemon, notifier))
    try:
        with suppress(asyncio.CancelledError):
            await running
    finally:
        reporting.cancel()
        if stopping is not None:
            stopping.cancel()
        notifier.close()


async def _report(daemon: Daemon, notifier: Notifier) -> None:
    """Report that it is ready, and feed the watchdog on the links' own event loop: a thread would hide a hung loop."""
    # Ready when ground stations can connect: the flight controller may appear at any time.
    await daemon.started.wait()
    notifier.ready()
    while notifier.watchdog_s is not None:
        if daemon.is_ticking:
            notifier.alive()
        await asyncio.sleep(notifier.watchdog_s / _FEEDS)
