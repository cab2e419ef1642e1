# SPDX-License-Identifier: GPL-3.0-or-later
"""Explains why a serial port cannot be used: missing, no permission, in use (by which program), or a login console."""

import errno
import os
import re
import termios
from pathlib import Path

from service.machine.host import Host

#: Errors of opening a port that another program uses.
BUSY = (errno.EBUSY, errno.EAGAIN)


def explain_port_error(path: str, error: OSError) -> str:
    """Turn an error from opening `path` into one sentence: what, where, what to do."""
    code = error.errno
    cause = error.__cause__ or error.__context__
    if code is None and isinstance(cause, OSError | termios.error):
        # pyserial hides the number; termios.error also has one, but is not an OSError.
        code = cause.args[0]
    if not Path(path).exists():
        return f"{path} is missing: plug the flight controller in, or name another port (fc)"
    if code in (errno.EACCES, errno.EPERM):
        return f"{path}: no permission; add the user to the group that owns it: sudo usermod -aG dialout $USER"
    if code in BUSY:
        host = Host()
        others = (process for process in host.processes() if process.pid != os.getpid())
        holder = next((process for process in others if host.has_open(process, path)), None)
        how = f": {host.stop_command(holder)}" if holder else ""
        return f"{path} is busy: {holder or 'another program'} has it open; name another port, or stop it{how}"
    if code in (errno.ENOTTY, errno.EISDIR):
        return f"{path} is not a serial port"
    return f"{path} cannot be opened: {error.strerror or error}"


def find_console(path: str) -> str | None:
    """The name of the terminal if a login console runs on the port, else None."""
    # Called four times a second: too often for a search through all processes while there is no port.
    terminal = Path(path).resolve().name
    return terminal if Path(path).exists() and Host().has_login(terminal) else None


def find_user(host: Host, path: str) -> str | None:
    """The name of another program that has the port open, or was started with its name, or None if none is found.

    A service cannot see the open files of root's programs, but it sees their command lines: `gpsd /dev/ttyUSB0`.
    """
    links = [name for name in host.names("/dev") if str(host.resolve(f"/dev/{name}")) == path]
    names = "|".join(re.escape(name) for name in {Path(path).name, *links})
    named = re.compile(rf"(?:^|[=,:])(?:/dev/)?(?:{names})(?:$|[,:])")
    for process in host.processes():
        if process.pid in (os.getpid(), os.getppid()) or not process.name:
            continue
        if any(named.search(argument) for argument in process.arguments[1:]) or host.has_open(process, path):
            return str(process)
    return None
