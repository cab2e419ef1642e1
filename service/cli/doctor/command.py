# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge doctor`."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import click

from payloads.mission_data import Json
from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, Grade, problem
from service.daemon.client import STATUS, ControlError, ask_daemon
from service.machine import event_loop
from service.machine.host import Host
from service.settings import Settings, SettingsError, load_settings
from service.settings.load import CONFIG_VARIABLE, SERVICE_CONFIG, SERVICE_STATE
from storage.store_error import StoreError
from terminal.command_group import PATH
from terminal.printing import print_json
from terminal.sentences import say

_COLOURS = {Grade.OK: "green", Grade.NOTE: "yellow", Grade.PROBLEM: "red"}


@click.command()
@click.option("--fc", metavar="FC", help="The flight controller's connection, as for `run`.")
@click.option(
    "--config",
    type=PATH,
    envvar=CONFIG_VARIABLE,
    help="The daemon's configuration. Default: the service's, if it is installed.",
)
@click.option("--state-dir", type=PATH, help="The daemon's folder for missions.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object per line for each check.")
def doctor(fc: str | None, config: Path | None, state_dir: Path | None, as_json: bool) -> None:
    """Diagnose problems of this machine, each with a remedy.

    Changes nothing, and does not disturb a running daemon. Exit code 1: a problem was found.
    """
    if not diagnose(fc, config, state_dir, as_json=as_json):
        raise SystemExit(1)


def diagnose(
    fc: str | None = None, config: Path | None = None, state_dir: Path | None = None, *, as_json: bool = False
) -> bool:
    """Print the result of each check. Returns False if there is a problem."""
    # A service's control socket is not in the state directory. With explicit options only that directory counts.
    asked = partial(ask_daemon, state_dir, STATUS)
    if config is None and fc is None and SERVICE_CONFIG.exists():
        config = SERVICE_CONFIG
        state_dir = state_dir or (SERVICE_STATE if SERVICE_STATE.is_symlink() else None)
    is_well = True
    for checked in examined(config, fc, state_dir, asked):
        _print(checked, as_json=as_json)
        if checked.grade is Grade.PROBLEM:
            is_well = False
    return is_well


def examined(
    config: Path | None,
    fc: str | None,
    state_dir: Path | None,
    ask_running: Callable[[], Json],
    host: Host | None = None,
    ask_port: Callable[[], Json] | None = None,
) -> Iterator[Checked]:
    """Yield the result of each check of the daemon with these options. `ask_port`: by default, listen on the port."""
    from service.cli.doctor.examination import examine  # half the daemon: --help does without

    try:
        settings = load_settings(config, fc=fc, state_dir=state_dir)
    except SettingsError as error:
        for wrong in error.problems:
            yield problem("configuration", *Fault.BAD_CONFIGURATION(why=wrong))
        return
    if config is not None:
        yield Checked("configuration", Grade.OK, f"{config} can be used")
    yield from examine(host or Host(), settings, ask_running, ask_port or (lambda: _listen(settings)))


def _listen(settings: Settings) -> Json:
    from service.cli.direct_bridge import ask_directly  # the whole daemon: --help does without

    try:
        return event_loop.run(ask_directly(settings.fc, STATUS, even_silent=True))
    except StoreError as error:
        raise ControlError(str(error)) from error


def _print(checked: Checked, *, as_json: bool) -> None:
    if as_json:
        print_json(checked.to_json())
        return
    grade = click.style(f"{checked.grade.value:7}", fg=_COLOURS[checked.grade], bold=checked.grade is Grade.PROBLEM)
    say(f"{checked.check}: {checked.found}", prefix=f"{grade}  ", indent=9)
    if checked.remedy.startswith("sudo "):  # one line, to be copied
        click.echo(f"{'':7}  -> {checked.remedy}")
    elif checked.remedy:
        say(checked.remedy, prefix=f"{'':7}  -> ", indent=12)
