"""The `naze-bridge` command: each subcommand lives in a file of its own and is imported only when it is used."""

import importlib

import click

#: Subcommand -> where it lives. A daemon on a Pi need not load what only `check` or `demo` use.
_COMMANDS = {
    "run": "service.run:run",
    "check": "service.check:check",
    "push": "service.mission_commands:push",
    "pull": "service.mission_commands:pull",
    "clear": "service.mission_commands:clear",
    "status": "service.mission_commands:status",
    "missions": "service.stored_missions:missions",
    "sim": "service.simulator.command:sim",
    "demo": "service.demo:demo",
}


class _LazyGroup(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        module, _, name = _COMMANDS[cmd_name].partition(":")
        command: click.Command = getattr(importlib.import_module(module), name)
        return command


@click.group(cls=_LazyGroup)
@click.version_option(package_name="naze-bridge")
def main() -> None:
    """Companion bridge between a MultiWii-family flight controller and MAVLink ground stations."""
