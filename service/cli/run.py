# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge run`: the daemon in the foreground."""

import asyncio
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from service.api import ControlError, ControlServer
from service.cli.printing import fail
from service.control_socket import socket_of_daemon
from service.daemon import Daemon
from service.lifecycle import run_until_signal
from service.links.gcs_links import LinkError
from service.log_setup import set_up_logging
from service.notify import Notifier
from service.recording.uart_recorder import UartFileError
from service.settings import DEFAULT_GCS, Settings, SettingsError, load_settings
from service.settings.load import CONFIG_VARIABLE
from service.web.settings import WebSettings
from service.zenoh_link.settings import ZenohSettings, ZenohSettingsError
from storage.state_lock import StateLock, StateUnusableError
from storage.store_error import StoreError

if TYPE_CHECKING:
    from service.web.server import WebServer
    from service.zenoh_link.node import Node


@click.command()
@click.option("--fc", metavar="FC", help="auto (the default), /dev/ttyAMA0, /dev/ttyUSB0,57600, tcp:HOST:PORT or sim")
@click.option("--gcs", metavar="GCS", multiple=True, help=f"Ground stations; may be repeated. Default: {DEFAULT_GCS}")
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    envvar=CONFIG_VARIABLE,
    help="TOML file with all settings; conf.d/*.toml in its folder override it.",
)
@click.option("--state-dir", type=click.Path(path_type=Path), help="Folder for stored missions.")
@click.option("--record-uart", type=click.Path(path_type=Path), help="File to record the port's traffic into.")
@click.option("--verbose", is_flag=True, help="Show debug events too.")
@click.option("--check-config", is_flag=True, help="Check the settings and exit.")
def run(
    fc: str | None,
    gcs: tuple[str, ...],
    config: Path | None,
    state_dir: Path | None,
    record_uart: Path | None,
    verbose: bool,
    check_config: bool,
) -> None:
    """Run the bridge between a flight controller and ground stations."""
    load = partial(load_settings, config, fc, gcs, state_dir, record_uart, verbose=verbose)
    try:
        settings = load()
    except SettingsError as error:
        raise click.UsageError(str(error)) from error
    if check_config:
        click.echo("The settings can be used.")
        return
    set_up_logging(settings.log_level)
    try:
        _serve(settings, load)
    except (ControlError, LinkError, StoreError, UartFileError, ZenohSettingsError) as error:
        fail(str(error))


def _serve(settings: Settings, load: Callable[[], Settings]) -> None:
    assert settings.state_dir is not None
    with ExitStack() as stack:
        # A disk that cannot be written keeps nobody on the ground: the store says so, and keeps missions in memory.
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
