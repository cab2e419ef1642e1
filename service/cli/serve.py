# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon of `naze-bridge run`, with its control socket, page and zenoh node."""

import asyncio
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.sentences import fail
from service.daemon.client import ControlError, socket_of_daemon
from service.daemon.control_server import ControlServer
from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.links.gcs_links import LinkError
from service.machine.log_setup import set_up_logging
from service.machine.notify import Notifier
from service.settings import Settings, SettingsError
from service.settings.web import WebSettings
from service.settings.zenoh import ZenohSettings, ZenohSettingsError
from storage.state_lock import StateLock, StateUnusableError
from storage.store_error import StoreError

if TYPE_CHECKING:
    from service.web.server import WebServer
    from service.zenoh_link.node import Node


def serve(settings: Settings, load: Callable[[], Settings]) -> None:
    """Run the daemon until a signal ends it; a failure ends the program with one sentence."""
    set_up_logging(settings.log_level)
    try:
        _serve(settings, load)
    except (ControlError, LinkError, StoreError, SettingsError, ZenohSettingsError) as error:
        fail(str(error))


def _serve(settings: Settings, load: Callable[[], Settings]) -> None:
    assert settings.state_dir is not None
    with ExitStack() as stack:
        # An unwritable disk must not prevent a flight: the store reports it, and keeps missions in memory.
        with suppress(StateUnusableError):
            stack.enter_context(StateLock(settings.state_dir))
        asyncio.run(_main(settings, load, socket_of_daemon(settings.state_dir)))


async def _main(settings: Settings, load: Callable[[], Settings], socket_path: Path) -> None:
    daemon = Daemon(settings)
    control = ControlServer(daemon, socket_path)
    zenoh_node = None if settings.zenoh is None else _zenoh_node(settings.zenoh, daemon)
    page = None if settings.web is None else _web_server(settings.web, daemon)
    await control.start()
    if zenoh_node is not None:
        zenoh_node.start()
    if page is not None:
        page.start()
    try:
        await run_until_signal(daemon, Notifier(), load)
    finally:
        await control.close()
        if page is not None:
            await page.close()
        if zenoh_node is not None:
            await zenoh_node.close()


def _zenoh_node(settings: ZenohSettings, daemon: Daemon) -> "Node":
    from service.zenoh_link.node import Node  # 10 MB that only its users pay for

    return Node(settings, daemon)


def _web_server(settings: WebSettings, daemon: Daemon) -> "WebServer":
    from service.web.server import WebServer  # 20 MB that only its users pay for

    return WebServer(daemon, settings)
