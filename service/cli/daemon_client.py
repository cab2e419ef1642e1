# SPDX-License-Identifier: GPL-3.0-or-later
"""Connects a command to a bridge: the running daemon's, or its own with `--fc`."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import click

from payloads.mission_data import Json, printable
from service.daemon.client import FIRMWARE_REQUESTS, ControlError, Interrupted, ask_daemon
from service.machine import event_loop
from service.settings import SettingsError
from service.settings.addresses import AddressError, parse_fc
from storage.store_error import StoreError
from terminal.command_group import PATH
from terminal.printing import console, print_json, progress_bars
from terminal.sentences import INTERRUPTED, complain, fail

_LEFT = "interrupted; the daemon continues: leave the board on, and see `naze-bridge status`"
_WRITES = ("push", "restore", "restore-settings", *FIRMWARE_REQUESTS)
_FLASH_BROKEN = "interrupted: the board stays in its boot loader; run the same command again"


@dataclass(frozen=True, slots=True)
class BridgeClient:
    """The bridge that a command talks to: its own on `fc`, else the daemon of `state_dir`. `as_json`: print JSON."""

    state_dir: Path | None
    as_json: bool
    fc: str | None = None

    def ask(self, request: Json, progress: Callable[[Any], None] = lambda _: None) -> Json:
        """Ask the bridge. A refusal ends the program with status 1, an unusable option with 2."""
        try:
            if self.fc is None:
                return ask_daemon(self.state_dir, request, progress)
            from service.cli.direct_bridge import ask_directly  # the whole daemon: --help does without

            asking = ask_directly(parse_fc(self.fc), request, progress, state_dir=self.state_dir)
            answer: Json = printable(event_loop.run(asking))
            return answer
        except (KeyboardInterrupt, Interrupted) as error:
            own = _FLASH_BROKEN if request["do"] in FIRMWARE_REQUESTS else str(error) or "interrupted"
            complain(own if self.fc is not None else _LEFT if request["do"] in _WRITES else "interrupted")
            raise SystemExit(INTERRUPTED) from None
        except (AddressError, SettingsError) as error:
            raise click.UsageError(str(error)) from error
        except (ControlError, StoreError) as error:
            fail(error)

    def ask_with_progress(self, request: Json, total: int | None = None) -> Json:
        """Ask for something that takes a while, with a progress bar on standard error.

        `total`: the records to write, or None if the bridge reports steps of "step", "done" and "total".
        """
        on = console(to_error=True)
        with progress_bars(on) as bar:
            task = bar.add_task("Starting" if total is None else "Flight controller", total=total)

            def show(progress: Any) -> None:
                if total is not None:
                    bar.update(task, completed=progress)
                elif progress["total"]:
                    step, done, of = (progress[key] for key in ("step", "done", "total"))
                    bar.update(task, description=step.capitalize(), completed=done, total=of)
                else:
                    on.out(f"naze-bridge: {progress['step']}")

            return self.ask(request, show)

    def show(self, answer: object, show_people: Callable[[], object]) -> None:
        if self.as_json:
            print_json(answer)
        else:
            show_people()


def daemon_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that select a daemon. The command gets them as a BridgeClient."""
    state_dir = click.option(
        "--state-dir",
        type=PATH,
        show_default="as the daemon's",
        help="State directory of the running daemon.",
    )
    as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")

    @wraps(command)
    def run(*args: Any, state_dir: Path | None, as_json: bool, fc: str | None = None, **options: Any) -> None:
        command(BridgeClient(state_dir, as_json, fc), *args, **options)

    return state_dir(as_json(run))


def bridge_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that select a bridge: a daemon's, or one of the command's own."""
    fc = click.option("--fc", metavar="FC", help="Talk to this flight controller directly, without a daemon.")
    return daemon_options(fc(command))
