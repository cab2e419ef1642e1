# SPDX-License-Identifier: GPL-3.0-or-later
"""Connects a command to a bridge: the running daemon's, or its own with `--fc`."""

import asyncio
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

import click

from payloads.mission_data import Json, printable
from service.daemon.client import FIRMWARE_REQUESTS, ControlError, Interrupted, NoDaemonError, ask_daemon
from service.settings import SettingsError, default_state_dir
from service.settings.addresses import AddressError, parse_fc
from service.settings.load import SERVICE_STATE
from storage.store_error import StoreError
from terminal.options import PATH
from terminal.sentences import INTERRUPTED, complain, fail

_GOES_ON = "the daemon continues, and the result follows; to exit now, press Ctrl-C again"
_LEFT = "interrupted; the daemon continues: see `naze-bridge missions list`, or `settings history`"
_WRITES = ("push", "restore", "restore-settings")
_FLASHES_ON = "interrupted; the daemon continues, do not switch the board off: see `naze-bridge status`"
_FLASH_BROKEN = "interrupted: the board stays in its boot loader; run the same command again"

F = TypeVar("F", bound=Callable[..., Any])


def daemon_options(command: F) -> F:
    state_dir = click.option(
        "--state-dir",
        type=PATH,
        show_default="as the daemon's",
        help="State directory of the running daemon.",
    )
    as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
    return state_dir(as_json(command))


def bridge_options(command: F) -> F:
    """Add the options that select a bridge: a daemon's, or one of the command's own."""
    fc = click.option("--fc", metavar="FC", help="Talk to this flight controller directly, without a daemon.")
    return daemon_options(fc(command))


def ask(
    state_dir: Path | None, fc: str | None, request: Json, progress: Callable[[Any], None] = lambda _: None
) -> Json:
    """Ask the bridge; a refusal ends the program with status 1, an unusable option with 2."""
    try:
        if fc is None:
            return ask_daemon(state_dir, request, progress)
        from service.cli.direct_bridge import ask_directly  # the whole daemon: --help does without

        return asyncio.run(ask_directly(parse_fc(fc), request, progress))
    except (KeyboardInterrupt, Interrupted) as error:
        complain(_interruption(request, str(error), is_own=fc is not None))
        raise SystemExit(INTERRUPTED) from None
    except (AddressError, SettingsError) as error:
        raise click.UsageError(str(error)) from error
    except (ControlError, StoreError) as error:
        fail(str(error))


def ask_with_progress(state_dir: Path | None, fc: str | None, request: Json, total: int) -> Json:
    """Ask the bridge to push `total` records, with a progress bar on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("[progress.description]{task.description}"), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("Flight controller", total=total)
        with nullcontext() if fc is not None else _first_interrupt(lambda: bar.console.out(f"naze-bridge: {_GOES_ON}")):
            return ask(state_dir, fc, request, lambda records: bar.update(task, completed=records))


def ask_with_steps(state_dir: Path | None, fc: str | None, request: Json) -> Json:
    """Ask the bridge for something in steps of "step", "done" and "total", with a progress bar on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("[progress.description]{task.description}"), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("Starting", total=None)

        def show(step: Json) -> None:
            if step["total"]:
                bar.update(task, description=step["step"].capitalize(), completed=step["done"], total=step["total"])
            else:
                console.out(f"naze-bridge: {step['step']}")

        with nullcontext() if fc is not None else _first_interrupt(lambda: bar.console.out(f"naze-bridge: {_GOES_ON}")):
            return ask(state_dir, fc, request, show)


def _interruption(request: Json, why: str, *, is_own: bool) -> str:
    if request["do"] in FIRMWARE_REQUESTS:
        return _FLASH_BROKEN if is_own else _FLASHES_ON
    return _LEFT if not is_own and request["do"] in _WRITES else why or "interrupted"


@contextmanager
def _first_interrupt(say: Callable[[], None]) -> Iterator[None]:
    """On the first Ctrl-C only call `say`; the second one raises KeyboardInterrupt, as usual."""
    usual = signal.getsignal(signal.SIGINT)
    if usual is not signal.default_int_handler:  # it is ignored, as for a shell's background jobs
        yield
        return

    def interrupted(_number: int, _frame: object) -> None:
        signal.signal(signal.SIGINT, usual)
        say()

    signal.signal(signal.SIGINT, interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)


def ask_store(state_dir: Path | None, request: Json) -> Json:
    """Ask the daemon for what it has stored; if none runs, read its store. A refusal ends the program with status 1."""
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
    from service.daemon.api import listed, shown
    from service.daemon.settings_api import backup_shown, backups_listed
    from service.daemon.store_worker import DATABASE_NAME
    from storage.mission_store import read_store

    folders = [state_dir] if state_dir is not None else [default_state_dir(), SERVICE_STATE]
    try:
        path = next((path for folder in folders if (path := folder / DATABASE_NAME).exists()), None)
    except PermissionError as error:
        raise ControlError(f"{SERVICE_STATE} cannot be read: use sudo") from error
    if path is None:
        raise ControlError(f"no missions or settings are stored in {' or '.join(map(str, folders))}: use --state-dir")
    with read_store(path) as store:
        limit, number = request.get("limit", 0), request.get("number", 0)
        answers: dict[str, Callable[[], Json]] = {
            "missions": lambda: listed(store, limit),
            "mission": lambda: shown(store, number),
            "backups": lambda: backups_listed(store, limit),
            "backup": lambda: backup_shown(store, number),
        }
        answer: Json = printable(answers[request["do"]]())
        return answer
