# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of the Raspberry Pi's power supply: below 4.63 V it slows down, loses USB devices and damages its card."""

import subprocess
from collections.abc import Callable

from service.cli.doctor.checked import Checked, note, ok, problem
from service.machine.host import Host

_ASK = ("vcgencmd", "get_throttled")
_HWMON = "/sys/class/hwmon"
#: `vcgencmd get_throttled`: undervoltage now, and since the start.
_NOW, _SINCE_START = 1 << 0, 1 << 16
_REMEDY = "use the Pi's own supply or a BEC of 5.1 V and 3 A, with short, thick wires"


def _ask_firmware() -> str:
    try:
        done = subprocess.run(_ASK, capture_output=True, text=True, check=False, timeout=5)  # noqa: S603  # our own words
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout


def check_power(host: Host, ask_firmware: Callable[[], str] = _ask_firmware) -> Checked | None:
    """Check for undervoltage; None on a machine that does not measure it."""
    alarm = next((alarm for name in host.names(_HWMON) if (alarm := _alarm(host, name)) is not None), None)
    try:
        flags = int(ask_firmware().strip().removeprefix("throttled="), 16)
    except ValueError:
        flags = None  # not a Pi, or no permission
    if alarm or (flags is not None and flags & _NOW):
        return problem("power", "the supply's voltage is too low", _REMEDY)
    if flags is not None and flags & _SINCE_START:
        return note("power", "the supply's voltage was too low since the start", _REMEDY)
    if flags is not None:
        return ok("power", "no undervoltage since the start")
    return None if alarm is None else ok("power", "no undervoltage")


def _alarm(host: Host, name: str) -> bool | None:
    """The kernel's undervoltage alarm; None if this is another sensor."""
    if host.read(f"{_HWMON}/{name}/name").strip() != "rpi_volt":
        return None
    return host.read(f"{_HWMON}/{name}/in0_lcrit_alarm").strip() == "1"
