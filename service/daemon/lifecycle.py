# SPDX-License-Identifier: GPL-3.0-or-later
"""The life of a daemon from the start to a signal, reported to systemd; SIGHUP reloads the settings."""

import asyncio
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, replace

import structlog

from service.daemon.daemon import Daemon
from service.machine.log_setup import set_log_level
from service.machine.notify import Notifier
from service.machine.threads import BackgroundThread
from service.settings import Settings, SettingsError

#: The number of watchdog messages per watchdog timeout.
_FEEDS = 3

_log = structlog.get_logger()


async def run_until_signal(daemon: Daemon, notifier: Notifier, load: Callable[[], Settings]) -> None:
    """Run the daemon until SIGINT or SIGTERM. A second signal does not wait for a transfer.

    SIGHUP reloads the settings with `load`.
    """
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
    reload_requested = asyncio.Event()
    loop.add_signal_handler(signal.SIGHUP, reload_requested.set)
    reloading = loop.create_task(_reload_on_request(reload_requested, daemon, notifier, load))
    feeding = None
    if notifier.watchdog_s is not None:
        feeding = loop.create_task(_feed_watchdog(daemon, notifier, notifier.watchdog_s))
    try:
        with suppress(asyncio.CancelledError):
            await running
    finally:
        if feeding is not None:
            feeding.cancel()
        reloading.cancel()
        if stopping is not None:
            stopping.cancel()
        notifier.close()


async def _feed_watchdog(daemon: Daemon, notifier: Notifier, watchdog_s: float) -> None:
    """On the links' own event loop: a thread would hide a hung loop."""
    while True:
        if daemon.is_ticking:
            notifier.alive()
        await asyncio.sleep(watchdog_s / _FEEDS)


async def _reload_on_request(
    requested: asyncio.Event, daemon: Daemon, notifier: Notifier, load: Callable[[], Settings]
) -> None:
    """Apply the result of `load` each time `requested` is set. Invalid settings do not change anything."""
    # Ready when ground stations can connect: the flight controller may appear at any time.
    await daemon.started.wait()
    notifier.ready()
    reader = BackgroundThread("settings")  # a hanging disk must delay neither the links nor the stop
    while await requested.wait():
        requested.clear()
        notifier.reloading()
        try:
            _take_over(daemon, await reader.ask(load))
        except SettingsError as error:
            _log.error("config.rejected", why=[str(problem) for problem in error.problems], what="nothing is changed")
        notifier.ready()


def _take_over(daemon: Daemon, new: Settings) -> None:
    old = daemon.settings
    compared = [field.name for field in fields(Settings) if field.compare]
    changed = {name for name in compared if getattr(old, name) != getattr(new, name)}
    live: set[str] = set()
    if "log_level" in changed:
        set_log_level(new.log_level)
        daemon.settings = replace(daemon.settings, log_level=new.log_level)
        live.add("log_level")
    if "access" in changed:
        # It needs a restart, and is written under `gcs`: the parts that guard and sign keep their keys.
        changed = changed - {"access"} | {"gcs"}
    elif "gcs" in changed:
        daemon.change_links(new.gcs)
        live.add("gcs")
    _log.info("config.reloaded", taken_over=sorted(live))
    if needs_restart := sorted(changed - live):
        _log.warning("config.needs_restart", settings=needs_restart)
