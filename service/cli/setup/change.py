# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes to a machine: files and commands. Each is described before it is made."""

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass

from service.machine.host import Host
from storage.os_error import reason
from storage.small_files import replace_file


class SetupError(Exception):
    """A change that failed, in one sentence."""


@dataclass(frozen=True, slots=True)
class WriteFile:
    """Create or replace a file. `secret`: only the owner may read it, and the text is not shown."""

    path: str
    text: str
    secret: bool = False

    def describe(self) -> str:
        return f"write {self.path}"


@dataclass(frozen=True, slots=True)
class RemoveFile:
    """Remove a file, if it exists."""

    path: str

    def describe(self) -> str:
        return f"remove {self.path}"


@dataclass(frozen=True, slots=True)
class Run:
    """Run a program and wait until it exits."""

    command: tuple[str, ...]

    def describe(self) -> str:
        return f"run {' '.join(self.command)}"


Change = WriteFile | RemoveFile | Run


def later(command: Sequence[str], delay_s: int, unit: str = "") -> tuple[str, ...]:
    """The command that runs another after a delay, in a separate unit."""
    named = (f"--unit={unit}",) if unit else ()
    # A timer's default accuracy is a minute.
    when = (f"--on-active={delay_s}", "--timer-property=AccuracySec=100ms")
    return ("systemd-run", "--quiet", "--collect", *named, *when, *command)


@dataclass(frozen=True, slots=True)
class Step:
    """Changes with one purpose.

    `needs_reboot`: they take effect after a reboot. `cuts_network`: they may end the pilot's own connection.
    """

    purpose: str
    changes: Sequence[Change]
    needs_reboot: bool = False
    cuts_network: bool = False


class Machine:
    """Makes changes. SetupError names the one that failed, and the reason."""

    def __init__(self, host: Host) -> None:
        self._host = host

    def carry_out(self, change: Change) -> None:
        if isinstance(change, Run):
            self.run(change.command)
            return
        path = self._host.path(change.path)
        try:
            if isinstance(change, RemoveFile):
                path.unlink(missing_ok=True)
                return
            path.parent.mkdir(parents=True, exist_ok=True)
            # Readable from the first moment: Avahi reads a new file at once.
            replace_file(path, change.text.encode(), 0o600 if change.secret else 0o644)
        except OSError as error:
            raise SetupError(f"{change.path} cannot be changed: {reason(error)}") from error

    def run(self, command: Sequence[str], timeout_s: float = 60) -> str:
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=timeout_s)  # noqa: S603  # our own words
        except (OSError, subprocess.TimeoutExpired) as error:
            raise SetupError(f"`{' '.join(command)}` failed: {error}") from error
        if done.returncode:
            said = (done.stderr or done.stdout).strip().splitlines()
            why = said[-1] if said else f"exit code {done.returncode}"
            raise SetupError(f"`{' '.join(command)}` failed: {why}")
        return done.stdout


def is_root() -> bool:
    return os.geteuid() == 0
