# SPDX-License-Identifier: GPL-3.0-or-later
"""The remedies that the status page's "Fix it" carries out, as changes of setup, whose undo also reverts them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from service.cli.setup.answers import SetupChoices, earlier_choices
from service.cli.setup.change import Change, Run, Step
from service.cli.setup.steps import console_steps, settings_steps, uart_steps
from service.machine.host import Host
from service.machine.raspberry_pi import wifi_country
from service.settings.config_files import PAGE_FILE, SETUP_FILE

#: Returns None where this machine lacks something that the remedy needs.
Fix = Callable[[Host], Step | None]

RESTART = Step("restart the bridge", [Run(("systemctl", "restart", "naze-bridge.service"))])
REBOOT = Step("restart the Pi", [Run(("systemctl", "reboot"))])


def restart_service(_host: Host) -> Step:
    return RESTART


def reboot(_host: Host) -> Step:
    return REBOOT


def set_fc(port: str, source: str) -> Fix | None:
    """Answer setup's question for the flight controller. `source`: where `fc` is set now; None if that is by hand."""
    if source and SETUP_FILE not in source and PAGE_FILE not in source:
        return None

    def fix(host: Host) -> Step:
        answers = replace(earlier_choices(host) or SetupChoices(), fc=port)
        changes: list[Change] = [change for step in settings_steps(host, answers) for change in step.changes]
        return Step(f"look for the flight controller on {port}", changes)

    return fix


def enable_uart(host: Host) -> Step | None:
    return next(uart_steps(host, SetupChoices()), None)


def free_port(terminals: set[str]) -> Fix:
    """Remove the login console from the named terminals ("ttyS0")."""
    return lambda host: next(console_steps(host, sorted(terminals)), None)


def stop_programs(*pids: int) -> Fix:
    words = [str(pid) for pid in pids]
    purpose = f"stop the {'program' if len(words) == 1 else 'programs'} with pid {', '.join(words)}"
    return lambda _host: Step(purpose, [Run(("kill", *words))])


def open_to_group(device: Path, group: str) -> Fix:
    commands = ("chgrp", group, str(device)), ("chmod", "g+rw", str(device))
    return lambda _host: Step(f"open {device} to the group {group}", [Run(command) for command in commands])


def stop_modem_manager(_host: Host) -> Step:
    words = "--now", "ModemManager.service"
    return Step("switch ModemManager off", [Run(("systemctl", "disable", *words), ("systemctl", "enable", *words))])


def unblock_wifi(host: Host) -> Step | None:
    step = Step("switch the Wi-Fi on", [Run(("rfkill", "unblock", "wlan"))])
    return step if wifi_country(host) else None  # without a country the radio is blocked again
