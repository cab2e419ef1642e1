# SPDX-License-Identifier: GPL-3.0-or-later
"""The remedies that the status page carries out, as changes of setup.

A remedy is only a name: its changes follow from this machine, never from a finding or a request.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from service.cli.setup.answers import SetupChoices, earlier_choices
from service.cli.setup.change import Run, Step
from service.cli.setup.hotspot import hotspot_name, switch_step
from service.cli.setup.steps import console_steps, header_consoles, settings_steps, uart_steps
from service.machine.host import Host
from service.machine.raspberry_pi import wifi_country

CLOSE_HOTSPOT = "close the hotspot"
ENABLE_UART = "enable the UART on the header"
FIND_FC = "look for the flight controller on all ports"
FREE_UART = "free the UART from the login console"
OPEN_HOTSPOT = "open the hotspot"
OPEN_PORTS = "give the serial ports to the group dialout"
RESTART_BRIDGE = "restart the bridge"
UNBLOCK_WIFI = "switch the Wi-Fi on"


def fix_step(fix: str, host: Host) -> Step | None:
    """The changes of a remedy, or None if it is unknown, or not possible or needed on this machine."""
    found = next(iter(_FIXES[fix](host)), None) if fix in _FIXES else None
    return None if found is None else replace(found, purpose=fix)


def _run(*command: str) -> list[Step]:
    return [Step("", [Run(command)])]


def _find_fc(host: Host) -> Iterable[Step]:
    return settings_steps(host, replace(earlier_choices(host) or SetupChoices(), fc=None))


def _switch_hotspot(host: Host, *, is_on: bool) -> Iterable[Step]:
    return [] if hotspot_name(host) is None else [switch_step(is_on=is_on)]


_FIXES: Mapping[str, Callable[[Host], Iterable[Step]]] = {
    CLOSE_HOTSPOT: lambda host: _switch_hotspot(host, is_on=False),
    ENABLE_UART: lambda host: uart_steps(host, SetupChoices()),
    FIND_FC: _find_fc,
    FREE_UART: lambda host: console_steps(host, header_consoles(host)),
    OPEN_HOTSPOT: lambda host: _switch_hotspot(host, is_on=True),
    OPEN_PORTS: lambda _host: _run("udevadm", "trigger", "--settle", "--subsystem-match=tty"),
    RESTART_BRIDGE: lambda _host: _run("systemctl", "restart", "naze-bridge.service"),
    # Without a country the radio would be blocked again.
    UNBLOCK_WIFI: lambda host: _run("rfkill", "unblock", "wlan") if wifi_country(host) else [],
}
