# SPDX-License-Identifier: GPL-3.0-or-later
"""What systemd is told, and how often it wants to hear from us: sd_notify(3).

Own code, because the protocol is one datagram: the packages for it that have a wheel know nothing of STOPPING and
RELOADING, and can wait for a slow systemd, which the loop that owns the links must not.
"""

import os
import socket
import time
from collections.abc import Mapping
from contextlib import suppress


class Notifier:
    """Speaks to the service manager; where there is none nothing is said. Never waits, never fails."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        #: A name that begins with @ is in Linux's abstract namespace.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) if address else None
        self.watchdog_s = _watchdog_s(environment)
        self._status = ""

    def ready(self) -> None:
        """The daemon runs, or runs on with the settings that it was told to read again."""
        self._say("READY=1")

    def reloading(self) -> None:
        """The settings are read again; `ready` ends that."""
        self._say(f"RELOADING=1\nMONOTONIC_USEC={time.monotonic_ns() // 1000}")

    def stopping(self) -> None:
        """The daemon is about to end."""
        self._say("STOPPING=1")

    def alive(self) -> None:
        """The loop turns: the watchdog can wait for another `watchdog_s`."""
        self._say("WATCHDOG=1")

    def status(self, text: str) -> None:
        """Tell `systemctl status` in one line how it stands; the same line is not told twice."""
        if text != self._status:
            self._status = text
            self._say(f"STATUS={text}")

    def close(self) -> None:
        """Say no more."""
        if self._socket is not None:
            self._socket.close()

    def _say(self, text: str) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.sendto(text.encode(), self._address)


def _watchdog_s(environment: Mapping[str, str]) -> float | None:
    """Return how long the watchdog waits for us, seconds; None if it is not meant for this process."""
    for_us = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    microseconds = environment.get("WATCHDOG_USEC", "")
    return int(microseconds) / 1e6 if for_us and microseconds.isdecimal() else None
