# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon of `naze-bridge run`, with the control socket, page and zenoh node."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from payloads.names import ZenohSettingsError
from service.daemon.client import ControlError, socket_of_daemon
from service.daemon.control_server import ControlServer
from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.links.gcs_links import LinkError
from service.machine import event_loop
from service.machine.log_setup import set_up_logging
from service.machine.notify import Notifier
from service.settings import Settings, SettingsError
from storage.state_lock import StateUnusableError, state_lock
from storage.store_error import StoreError
from terminal.sentences import fail

if TYPE_CHECKING:
    from service.web.server import WebServer
    from service.zenoh_link.node import Node


def serve(settings: Settings) -> None:
    """Run the daemon until a signal ends it. A failure ends the program with one sentence."""
    set_up_logging(settings.log_level)
    os.umask(0o077)  # logs and missions show where the pilot was. The unit sets the same
    try:
        _serve(settings)
    except (ControlError, LinkError, StoreError, SettingsError, ZenohSettingsError) as error:
        fail(error)


def _serve(settings: Settings) -> None:
    assert settings.state_dir is not None
    with ExitStack() as stack:
        # An unwritable disk must not prevent a flight: the store reports it, and keeps missions in memory.
        with suppress(StateUnusableError):
            stack.enter_context(state_lock(settings.state_dir))
        event_loop.run(_main(settings, socket_of_daemon(settings.state_dir)))


async def _main(settings: Settings, socket_path: Path) -> None:
    daemon = Daemon(settings)
    control = ControlServer(daemon, socket_path)
    parts = list(_parts(settings, daemon))
    await control.start()
    for part in parts:
        part.start()
    try:
        await run_until_signal(daemon, Notifier())
    finally:
        for each in (control, *reversed(parts)):
            await each.close()


def _parts(settings: Settings, daemon: Daemon) -> "Iterator[Node | WebServer]":
    """The parts that are configured. Only then are they imported: they take 10 and 20 MB."""
    if settings.zenoh is not None:
        from service.zenoh_link.node import Node

        yield Node(settings.zenoh, daemon)
    if settings.web is not None:
        from service.web.server import WebServer

        yield WebServer(daemon, settings.web)
