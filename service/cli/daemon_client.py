# SPDX-License-Identifier: GPL-3.0-or-later
"""How a command of the command line reaches a bridge: the running daemon's, or one of its own with `--fc`."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from service.api import ControlError, MissionJobs, NoDaemonError, ask_daemon, listed, shown
from service.cli.printing import fail
from service.daemon import Daemon
from service.links.connection import AddressError, AutoFc, FcAddress, parse_fc
from service.log_setup import set_up_logging
from service.mission_data import Json
from service.settings import Settings, SettingsError, default_state_dir, takeoff_limit_m
from service.store_worker import DATABASE_NAME
from storage.mission_store import read_store
from storage.store_error import StoreError

#: An unknown speed is found within 8 s.
_SEARCH_PATIENCE_S = 12.0
#: With `auto`: the header and two on USB.
_PORTS_SEARCHED = 3
_INTERRUPTED = 130  # as shells have it: 128 + SIGINT
_GOES_ON = "interrupted; the daemon goes on with it: see `naze-bridge status` and `naze-bridge missions list`"
_CANCELLED = "interrupted; what was not finished within 2 s was given up: see `naze-bridge pull`"
#: A round of telemetry takes a second; at 9600 baud two.
_TELEMETRY_PATIENCE_S = 3.0
_INTERVAL_S = 0.05
_TOLD_LATER = ("armed", "battery_v", "satellites", "mission_records")
#: Where the service keeps its missions.
SERVICE_STATE = Path("/var/lib/naze-bridge")
#: The request for how the bridge stands.
STATUS = {"do": "status"}

F = TypeVar("F", bound=Callable[..., Any])


def daemon_options(command: F) -> F:
    """Add the options that say which daemon is meant."""
    state_dir = click.option(
        "--state-dir",
        type=click.Path(path_type=Path),
        show_default="as the daemon's",
        help="State directory of the running daemon.",
    )
    as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
    return state_dir(as_json(command))


def bridge_options(command: F) -> F:
    """Add the options that say which bridge is meant, be it a daemon's or one of the command's own."""
    fc = click.option("--fc", metavar="FC", help="Talk to this flight controller directly, without a daemon.")
    return daemon_options(fc(command))


def ask(
    state_dir: Path | None, fc: str | None, request: Json, progress: Callable[[int], None] = lambda _: None
) -> Json:
    """Ask the bridge; a refusal ends the program with status 1, an unusable option with 2."""
    try:
        if fc is None:
            return ask_daemon(state_dir, request, progress)
        return asyncio.run(ask_directly(parse_fc(fc), request, progress))
    except KeyboardInterrupt:
        click.echo(f"naze-bridge: {_GOES_ON if fc is None else _CANCELLED}", err=True)
        raise SystemExit(_INTERRUPTED) from None
    except (AddressError, SettingsError) as error:
        raise click.UsageError(str(error)) from error
    except (ControlError, StoreError) as error:
        fail(str(error))


def ask_with_progress(state_dir: Path | None, fc: str | None, request: Json, total: int) -> Json:
    """Ask the bridge to push `total` records, with a progress bar on standard error."""
    columns = (TextColumn("[progress.description]{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("Flight controller", total=total)
        return ask(state_dir, fc, request, lambda records: bar.update(task, completed=records))


def ask_store(state_dir: Path | None, request: Json) -> Json:
    """Ask the daemon for stored missions; if none runs, read its store. A refusal ends the program with status 1."""
    try:
        try:
            return ask_daemon(state_dir, request)
        except NoDaemonError:
            return _read_store(state_dir, request)
    except SettingsError as error:
        raise click.UsageError(str(error)) from error
    except (ControlError, StoreError) as error:
        fail(str(error))


def _read_store(state_dir: Path | None, request: Json) -> Json:
    folders = [state_dir] if state_dir is not None else [default_state_dir(), SERVICE_STATE]
    try:
        path = next((path for folder in folders if (path := folder / DATABASE_NAME).exists()), None)
    except PermissionError as error:
        raise ControlError(f"{SERVICE_STATE} is closed to you: use sudo") from error
    if path is None:
        raise ControlError(f"no missions are stored in {' or '.join(map(str, folders))}: name the folder, --state-dir")
    with read_store(path) as store:
        return listed(store, request["limit"]) if request["do"] == "missions" else shown(store, request["number"])


async def ask_directly(fc: FcAddress, request: Json, progress: Callable[[int], None] = lambda _: None) -> Json:
    """Ask a bridge of our own on this port; ControlError or StoreError say why there is no answer."""
    set_up_logging("error")
    daemon = Daemon(Settings(fc, takeoff_max_m=takeoff_limit_m()))
    jobs = MissionJobs(daemon)
    running = asyncio.create_task(daemon.run())
    try:
        patience_s = _SEARCH_PATIENCE_S * (_PORTS_SEARCHED if isinstance(fc, AutoFc) else 1)
        await _wait(lambda: bool(daemon.fc_trouble or daemon.bridge.session.controller), patience_s)
        if daemon.fc_trouble:
            raise ControlError(daemon.fc_trouble)
        if daemon.bridge.session.controller is None:
            where = daemon.fc_where
            raise ControlError(f"no flight controller answers on {where}: check its power, the wiring and the speed")
        # Who it is comes before what it tells of itself, and some controllers never tell all of it.
        if request == STATUS:
            await _wait(lambda: None not in map(jobs.status().get, _TOLD_LATER), _TELEMETRY_PATIENCE_S)
        return await jobs.do(request, lambda answer: progress(answer["progress"]))
    except asyncio.CancelledError:
        # A mission is either finished or given up cleanly, never left in the middle.
        await daemon.finish()
        raise
    finally:
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running


async def _wait(condition: Callable[[], bool], seconds: float) -> None:
    """Wait until something is so, but not longer than that."""
    for _ in range(int(seconds / _INTERVAL_S)):
        if condition():
            return
        await asyncio.sleep(_INTERVAL_S)
