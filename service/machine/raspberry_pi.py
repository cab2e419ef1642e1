# SPDX-License-Identifier: GPL-3.0-or-later
"""Raspberry Pi models: the UART on GPIO 14 and 15, the config.txt line that enables it, and the clock."""

import re
from dataclasses import dataclass
from datetime import timedelta

from protocols.remedies import Fault
from service.machine.host import Host

#: Bookworm and later, and before.
BOOT_FOLDERS = ("/boot/firmware", "/boot")
#: Made by systemd-timesyncd when it has set the clock. adjtimex(2) is forbidden to the hardened service.
SYNCHRONIZED = "/run/systemd/timesync/synchronized"
#: A signature may be as late.
_CLOCK_TOLERANCE_S = 60


@dataclass(frozen=True, slots=True)
class PiModel:
    """`name`: from the device tree. `header_uart`: the device on pins 8 and 10. `config_line`: enables it."""

    name: str
    header_uart: str
    config_line: str


def pi_model(host: Host) -> PiModel | None:
    """The machine's Raspberry Pi model, or None on other machines.

    On a Pi 5 /dev/serial0 is usually the debug socket between the HDMI plugs (ttyAMA10). The header always has ttyAMA0.
    On earlier models serial0 is the header's: ttyS0 where Bluetooth has the better UART, else ttyAMA0.
    """
    name = host.read("/proc/device-tree/model").rstrip("\0\n")
    if not name.startswith("Raspberry Pi"):
        return None
    if name.startswith(("Raspberry Pi 5", "Raspberry Pi Compute Module 5")):
        return PiModel(name, "/dev/ttyAMA0", "dtparam=uart0=on")
    return PiModel(name, "/dev/serial0", "enable_uart=1")


def is_mini_uart(host: Host, device: str) -> bool:
    """True for the UART that models before the Pi 5 have on the header while Bluetooth has the better one.

    It lacks a FIFO to speak of, and the speed follows the core's clock.
    """
    model = pi_model(host)
    return model is not None and model.header_uart == "/dev/serial0" and str(host.resolve(device)) == "/dev/ttyS0"


def is_clock_set(host: Host) -> bool:
    """False on a Pi until a network has set the clock: without a battery it continues from the last shutdown."""
    return host.path(SYNCHRONIZED).exists() or pi_model(host) is None


def clock_trouble(off_s: float, whose: str) -> str:
    """A sentence with its remedy, after a colon, about a clock that is wrong by so many seconds; empty for a right one.

    The remedy is relative, because a time of day would be over before it is typed.
    """
    if abs(off_s) < _CLOCK_TOLERANCE_S:
        return ""
    far = timedelta(seconds=round(abs(off_s)))
    side = "behind" if off_s > 0 else "ahead of"
    return ": ".join(Fault.LATE_CLOCK(far=far, side=side, whose=whose, off_s=off_s))


def boot_file(host: Host, name: str) -> str | None:
    """Path of config.txt or cmdline.txt, or None if there is none."""
    paths = [f"{folder}/{name}" for folder in BOOT_FOLDERS]
    return next((path for path in paths if host.path(path).exists()), None)


def wifi_country(host: Host) -> str | None:
    """The country, such as "DE", that raspi-config has set. Without one the radio is blocked."""
    found = re.search(r"cfg80211\.ieee80211_regdom=([A-Z]{2})", host.read(boot_file(host, "cmdline.txt") or ""))
    return found and found[1]
