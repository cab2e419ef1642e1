# SPDX-License-Identifier: GPL-3.0-or-later
"""The life of a daemon from its start to a signal, reported to systemd; SIGHUP reloads the settings."""

import asyncio
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, replace

import structlog

from reports.vehicle_groups import Group, Link, Status
from service.daemon.daemon import Daemon
from service.machine.log_setup import set_log_level
from service.machine.notify import Notifier
from service.machine.threads import BackgroundThread
from service.settings import Settings, SettingsError

#: The interval of status updates, and the minimum number of watchdog messages per watchdog timeout.
_INTERVAL_S = 2.0
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
    reporting = _Reporting(daemon, notifier)
    try:
        with suppress(asyncio.CancelledError):
            await running
    finally:
        reporting.end()
        reloading.cancel()
        if stopping is not None:
            stopping.cancel()
        notifier.close()


class _Reporting:
    """Feeds the watchdog and reports the status from the links' own event loop: a thread would hide a hung loop."""

    def __init__(self, daemon: Daemon, notifier: Notifier) -> None:
        self._daemon = daemon
        self._notifier = notifier
        watchdog_s = notifier.watchdog_s
        self._interval_s = _INTERVAL_S if watchdog_s is None else min(_INTERVAL_S, watchdog_s / _FEEDS)
        self._timer: asyncio.Handle = asyncio.get_running_loop().call_soon(self._report)

    def end(self) -> None:
        self._timer.cancel()

    def _report(self) -> None:
        if self._daemon.is_ticking:
            self._notifier.alive()
        loop = asyncio.get_running_loop()
        self._notifier.status(_link_line(self._daemon, loop.time()))
        self._timer = loop.call_later(self._interval_s, self._report)


def _link_line(daemon: Daemon, now: float) -> str:
    """The flight controller and the ground stations in one line."""
    link: Link = daemon.bridge.group(Group.LINK, now)
    status: Status = daemon.bridge.group(Group.STATUS, now)
    if daemon.fc.trouble:
        where = daemon.fc.trouble
    elif link.flight_controller is None:
        where = f"looking for a flight controller on {daemon.fc.where}"
    else:
        speed = "" if link.speed_baud is None else f", {link.speed_baud} baud"
        armed = {None: "", True: ", armed", False: ", disarmed"}[status.armed]
        where = f"{link.flight_controller} ({link.state}{speed}{armed})"
    count = len(link.ground_stations)
    return f"{where}; {count} ground station{'' if count == 1 else 's'}"


async def _reload_on_request(
    requested: asyncio.Event, daemon: Daemon, notifier: Notifier, load: Callable[[], Settings]
) -> None:
    """Apply the result of `load` each time `requested` is set; invalid settings change nothing."""
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
