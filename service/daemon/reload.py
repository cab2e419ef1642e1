# SPDX-License-Identifier: GPL-3.0-or-later
"""SIGHUP: reloads the settings and applies those that can change at run time."""

import asyncio
from collections.abc import Callable
from dataclasses import fields, replace

import structlog

from service.daemon.daemon import Daemon
from service.machine.log_setup import set_log_level
from service.machine.notify import Notifier
from service.settings import Settings, SettingsError

_log = structlog.get_logger()


async def reload_when_told(
    told: asyncio.Event, daemon: Daemon, notifier: Notifier, load: Callable[[], Settings]
) -> None:
    """Apply the result of `load` each time `told` is set; invalid settings change nothing."""
    while await told.wait():
        told.clear()
        notifier.reloading()
        try:
            # In a thread: a slow disk must not delay the links.
            _take_over(daemon, await asyncio.to_thread(load))
        except SettingsError as error:
            _log.error("config.rejected", why=[str(problem) for problem in error.problems], what="nothing is changed")
        notifier.ready()


def _take_over(daemon: Daemon, new: Settings) -> None:
    old = daemon.settings
    changed = {field.name for field in fields(Settings) if getattr(old, field.name) != getattr(new, field.name)}
    live: set[str] = set()
    if "log_level" in changed:
        set_log_level(new.log_level)
        daemon.settings = replace(daemon.settings, log_level=new.log_level)
        live.add("log_level")
    if "access" in changed:
        # Keys are held by the parts that guard and sign: write access is not changed during a transfer.
        changed = changed - {"access"} | {"gcs"}
    elif "gcs" in changed:
        daemon.change_links(new.gcs)
        live.add("gcs")
    _log.info("config.reloaded", taken_over=sorted(live))
    if needs_restart := sorted(changed - live):
        _log.warning("config.needs_restart", settings=needs_restart)
