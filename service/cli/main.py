# SPDX-License-Identifier: GPL-3.0-or-later
"""The `naze-bridge` command: each subcommand lives in a file of its own and is imported only when it is used."""

import errno
import importlib
import os
import sys
from typing import Any

import click

#: Subcommand -> where it lives. A daemon on a Pi need not load what only `check` or `demo` use.
_COMMANDS = {
    "run": "service.cli.run:run",
    "check": "service.cli.check:check",
    "push": "service.cli.mission_commands:push",
    "pull": "service.cli.mission_commands:pull",
    "clear": "service.cli.mission_commands:clear",
    "status": "service.cli.mission_commands:status",
    "missions": "service.cli.stored_missions:missions",
    "fleet": "service.fleet.command:fleet",
    "doctor": "service.doctor.command:doctor",
    "sim": "simulator.command:sim",
    "demo": "service.cli.demo:demo",
}

_UNWRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class _LazyGroup(click.Group):
    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run to the end of the program. A full disk behind standard output is one sentence and status 74 (EX_IOERR).

        Click itself is silent about a reader who has seen enough (`| head`).
        """
        try:
            return super().main(*args, **kwargs)
        except OSError as error:
            if error.errno not in _UNWRITABLE:
                raise
            click.echo(f"naze-bridge: the output cannot be written: {error.strerror}", err=True)
            # What is still in the buffer would fail once more at the interpreter's end.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(os.EX_IOERR)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        if cmd_name == "run":
            _load_structlog_alone()
        module, _, name = _COMMANDS[cmd_name].partition(":")
        command: click.Command = getattr(importlib.import_module(module), name)
        return command


def _load_structlog_alone() -> None:
    """Import structlog as if there were no rich, which it would load for tracebacks: 5 MB that no daemon needs."""
    if "structlog" in sys.modules or "rich" in sys.modules:
        return
    sys.modules["rich"] = None  # type: ignore[assignment]
    importlib.import_module("structlog")
    del sys.modules["rich"]


@click.group(cls=_LazyGroup)
@click.version_option(package_name="naze-bridge")
def main() -> None:
    """Companion bridge between a MultiWii-family flight controller and MAVLink ground stations."""
