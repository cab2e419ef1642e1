# SPDX-License-Identifier: GPL-3.0-or-later
"""The `naze-bridge` command: each subcommand is in its own file and is imported only when it is used."""

import errno
import importlib
import os
import sys
from typing import Any, NoReturn

import click

from storage.os_error import reason
from terminal.command_group import LazyCommand, LazyGroup
from terminal.sentences import INTERRUPTED, complain

_COMMANDS = {
    "setup": LazyCommand("service.cli.setup.command:setup", "Set this Raspberry Pi up: UART, Wi-Fi, page, service."),
    "card": LazyCommand("service.cli.card:card", "Prepare a card that sets itself up at its first start."),
    "token": LazyCommand("service.cli.setup.command:token", "Show the status page's token and its QR code."),
    "run": LazyCommand("service.cli.run:run", "Run the bridge in the foreground."),
    "status": LazyCommand("service.cli.status:status", "Show the state of the bridge and the vehicle."),
    "doctor": LazyCommand("service.cli.doctor.command:doctor", "Diagnose setup problems."),
    "check": LazyCommand("service.cli.check:check", "Show how mission files would be stored, offline."),
    "convert": LazyCommand("service.cli.convert:convert", "Write a mission file in another format."),
    "fly": LazyCommand("service.cli.fly:fly", "Fly a mission file in a simulation, with your own firmware."),
    "push": LazyCommand("service.cli.mission_commands:push", "Write a mission file and verify it."),
    "pull": LazyCommand("service.cli.mission_commands:pull", "Read the mission from the flight controller."),
    "clear": LazyCommand("service.cli.mission_commands:clear", "Clear the mission on the flight controller."),
    "missions": LazyCommand("service.cli.stored_missions:missions", "List, show and restore missions."),
    "signing": LazyCommand("service.cli.signing:signing", "Accept ground stations again after a wrong clock."),
    "settings": LazyCommand("service.cli.settings_commands:settings", "The flight controller's settings and backups."),
    "firmware": LazyCommand("service.cli.firmware_commands:firmware", "Build and flash a Harakiri with the patch."),
    "fleet": LazyCommand("service.cli.fleet_command:fleet", "Manage many vehicles over Eclipse zenoh."),
    "sim": LazyCommand("simulator.commands.sim:sim", "Simulate a flight controller."),
    "demo": LazyCommand("service.cli.demo:demo", "Demonstrate a mission upload to a simulated Naze."),
}

#: Libraries and their optional dependencies that the daemon does not need, OpenSSL and coloured logs: with these 10 MB
#: it would exceed the 42 MB that it may have.
_OPTIONAL = (("hmac", "_hashlib"), ("asyncio", "ssl"), ("structlog", "rich"))
_UNWRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class _Main(LazyGroup):
    def main(self, *args: Any, **kwargs: Any) -> NoReturn:
        """Run the program. Every failure is one sentence after the program's name.

        The status is 74 (EX_IOERR) if standard output cannot be written, as on a full disk. Click itself ignores a
        closed pipe (`| head`).
        """
        color = False if os.environ.get("NO_COLOR") else None  # None: on a terminal
        try:
            code = super().main(*args, **kwargs | {"standalone_mode": False, "color": color})
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            sys.exit(error.exit_code)
        except click.ClickException as error:
            text, context = error.format_message(), getattr(error, "ctx", None)
            needs_help = text.startswith(("Missing ", "No such option", "Got unexp")) and not text.endswith("?")
            complain(f"{text.rstrip('.')}; see `{context.command_path} --help`" if needs_help and context else text)
            sys.exit(error.exit_code)
        except click.Abort as error:
            if isinstance(error.__context__, EOFError):
                complain("standard input ended before the question was answered: run this in a terminal, or see --help")
                sys.exit(1)
            complain("interrupted")
            sys.exit(INTERRUPTED)
        except ModuleNotFoundError as error:
            # deb/tree.py divides the program into two packages.
            if not (error.name or "").startswith("simulator."):
                raise
            complain("this command is in the package naze-bridge-sim, released with naze-bridge: install both together")
            sys.exit(1)
        except OSError as error:
            if error.errno not in _UNWRITABLE:
                raise
            complain(f"the output cannot be written: {reason(error)}")
            # The unwritten buffer would fail again at the interpreter's exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(os.EX_IOERR)
        sys.exit(code if isinstance(code, int) else 0)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name == "run":
            for library, dependency in _OPTIONAL:
                _import_without(library, dependency)
        return super().get_command(ctx, cmd_name)


def _import_without(library: str, dependency: str) -> None:
    """Let the import of an optional dependency fail: None in sys.modules is Python's own way to say so."""
    if library in sys.modules or dependency in sys.modules:
        return
    sys.modules[dependency] = None  # type: ignore[assignment]
    importlib.import_module(library)
    del sys.modules[dependency]


def _show_version(context: click.Context, _option: click.Parameter, is_given: bool) -> None:  # click's
    if not is_given or context.resilient_parsing:
        return
    from service.machine.package import address, version  # reads files: not at every start

    click.echo(f"naze-bridge, version {version()}")
    issues = address("Issues") or "ask where you got this copy from, because it does not name an address"
    click.echo(f"Problems, questions, recordings: {issues}")
    context.exit()


@click.group(cls=_Main, commands=_COMMANDS, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
def main() -> None:
    """Companion bridge between a MultiWii-family flight controller and MAVLink ground stations.

    Exit codes: 0 done, 1 refused or failed, 2 wrong usage or an unreadable file, 74 the output cannot be written, 130
    interrupted. Commands list further codes in their own help.
    """
