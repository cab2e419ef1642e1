# SPDX-License-Identifier: GPL-3.0-or-later
"""Says why a serial port cannot be used: missing, not permitted, busy (by whom), or a login console."""

import errno
import os
import re
import termios
from pathlib import Path

from service.host import Host

_LOGIN_PROGRAMS = ("agetty", "getty", "login")


def explain_port_error(path: str, error: OSError) -> str:
    """Turn an error from opening `path` into one sentence: what, where, what to do."""
    code = error.errno
    cause = error.__cause__ or error.__context__
    if code is None and isinstance(cause, OSError | termios.error):
        # pyserial keeps the number to itself; termios.error has one, too, but is no OSError.
        code = cause.args[0]
    if not Path(path).exists():
        return f"{path} is missing: plug the flight controller in, or name another port with --fc"
    if code in (errno.EACCES, errno.EPERM):
        return f"{path}: no permission; add the user to the group that owns it: sudo usermod -aG dialout $USER"
    if code in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        holder = find_holder(path)
        return f"{path} is busy: {holder or 'another program'} has it open; stop that, or name another port"
    if code in (errno.ENOTTY, errno.EISDIR):
        return f"{path} is no serial port"
    return f"{path} cannot be opened: {error.strerror or error}"


def find_console(path: str) -> str | None:
    """Return the name of the terminal if a login console sits on the port, else None.

    A getty takes no lock: both could open the port, and each would eat half of what the other is sent.
    """
    if not Path(path).exists():
        # It is looked for four times a second: no search through all processes for that.
        return None
    terminal = Path(path).resolve().name
    for process in _processes():
        try:
            command = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        program = os.path.basename(command[0]).decode(errors="replace")
        if program in _LOGIN_PROGRAMS and terminal.encode() in command[1:]:
            return terminal
    return None


def find_holder(path: str) -> str | None:
    """Return "NAME (pid N)" of another process that has the port open, as far as we may see it."""
    try:
        target = os.stat(path)
    except OSError:
        return None
    for process in _processes():
        if process.name == str(os.getpid()):
            continue
        try:
            for descriptor in (process / "fd").iterdir():
                # By the device: a process in a container may have another one of the same name.
                if os.path.samestat(descriptor.stat(), target):
                    return f"{(process / 'comm').read_text().strip()} (pid {process.name})"
        except OSError:
            continue
    return None


def find_user(host: Host, path: str) -> str | None:
    """Name another program that has the port open, or was started with its name; None if there seems to be none.

    A service may not see what root's programs have open, but their command lines: `gpsd /dev/ttyUSB0`.
    """
    links = [name for name in host.names("/dev") if str(host.resolve(f"/dev/{name}")) == path]
    names = "|".join(re.escape(name) for name in {Path(path).name, *links})
    named = re.compile(rf"(?:^|[=,:])(?:/dev/)?(?:{names})(?:$|[,:])")
    for process in host.processes():
        if process.pid in (os.getpid(), os.getppid()) or not process.name:
            continue
        if any(named.search(argument) for argument in process.arguments[1:]) or host.has_open(process, path):
            return f"{process.name} (pid {process.pid})"
    return None


def _processes() -> list[Path]:
    return [entry for entry in Path("/proc").iterdir() if entry.name.isdecimal()]
