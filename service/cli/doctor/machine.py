# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the machine: the clock, power supply, disk, stored missions and software versions."""

import os
import platform
import shutil
import sqlite3
import subprocess
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

from protocols.plain_text import plain_text
from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, note, ok, problem
from service.cli.doctor.fixes import RESTART_BRIDGE
from service.daemon.store_worker import DATABASE_NAME
from service.machine.host import Host
from service.machine.package import version
from service.machine.raspberry_pi import SYNCHRONIZED
from storage.database import kept_aside, read_database
from storage.store_error import StoreError

_TIME_PROGRAMS = ("chronyd", "ntpd", "gpsd")
#: A Pi without a clock starts in 1970, or at the last shutdown. No release is older than this.
EPOCH = datetime(2026, 1, 1, tzinfo=UTC)
_LEAST_FREE = 64 << 20
_LIBRARIES = ("pyserial", "eclipse-zenoh")
#: Bits of the reply: undervoltage now, and since the start.
_NOW, _SINCE_START = 1 << 0, 1 << 16


def check_versions(host: Host) -> Checked:
    """The versions, for a bug report."""
    system = next((line for line in host.read("/etc/os-release").splitlines() if line.startswith("PRETTY_NAME=")), "")
    libraries = [f"{name} {version(name)}" for name in _LIBRARIES]
    where = system.partition("=")[2].strip('"') or platform.system()
    return ok(
        "versions",
        f"naze-bridge {version()}, Python {platform.python_version()}, SQLite {sqlite3.sqlite_version}, "
        f"{', '.join(libraries)}, {where} on {platform.machine()}",
    )


def check_clock(host: Host, now: datetime, trouble: str = "") -> Checked:
    """Check the clock, which logs and signatures depend on. `trouble`: what a running daemon knows."""
    time_text = f"{now:%Y-%m-%d %H:%M} UTC"
    if trouble:
        found, _, remedy = trouble.partition(": ")
        return problem("clock", found, remedy)
    if now < EPOCH:
        return problem("clock", *Fault.OLD_CLOCK(time=time_text))
    if host.path(SYNCHRONIZED).exists():
        return ok("clock", f"{time_text}, set by the network")
    keeper = next((process.name for process in host.processes() if process.name in _TIME_PROGRAMS), None)
    if keeper is not None:
        return ok("clock", f"{time_text}, kept by {keeper}")
    return note("clock", *Fault.UNSET_CLOCK(time=time_text))


def check_root(host: Host) -> Checked | None:
    """Check that changes to the system survive a restart."""
    # The mount's own options do not count: those of the helper's unit make the root read-only for it.
    mounts = [line.partition(" - ")[::2] for line in host.read("/proc/self/mountinfo").splitlines()]
    disks = [disk.split() for mount, disk in mounts if mount.split()[4:5] == ["/"]]
    kind, _, options = (*disks[-1], "", "", "")[:3] if disks else ("", "", "")
    if kind == "overlay":
        return note("root", *Fault.ROOT_IN_MEMORY())
    if "ro" in options.split(","):
        return note("root", *Fault.READ_ONLY_ROOT())
    return None


def check_disk(state_dir: Path, free_of: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free) -> Checked:
    folder = state_dir
    try:
        while not folder.exists():
            folder = folder.parent
        if not folder.is_dir():
            return problem("disk", *Fault.STATE_DIR_IS_FILE(path=state_dir, folder=folder))
        if not os.statvfs(folder).f_blocks:
            return problem("disk", *Fault.STATE_DIR_NOT_KEPT(path=state_dir, folder=folder))
        free = free_of(folder)
    except PermissionError:
        return note("disk", *Fault.NOT_ALLOWED(use="read", path=state_dir))
    if os.statvfs(folder).f_flag & os.ST_RDONLY:
        return problem("disk", *Fault.READ_ONLY_DISK(path=folder))
    if os.geteuid() and not os.access(folder, os.W_OK):
        return note("disk", *Fault.NOT_ALLOWED(use="write to", path=folder))
    found = Fault.DISK_NEARLY_FULL(free=free >> 20, path=state_dir)
    return problem("disk", *found) if free < _LEAST_FREE else ok("disk", found[0])


def check_database(state_dir: Path) -> list[Checked]:
    path = state_dir / DATABASE_NAME
    found = []
    try:
        exists = path.exists()
        aside = kept_aside(path)
    except PermissionError:
        return [note("missions", *Fault.NOT_ALLOWED(use="read", path=path))]
    if not exists:
        found.append(ok("missions", f"none stored yet in {state_dir}"))
    else:
        found.append(_look_into(path))
    if aside:
        found.append(note("missions", *Fault.STORE_KEPT_ASIDE(path=aside[-1])))
    return found


def _look_into(path: Path) -> Checked:
    try:
        # Read-only: a daemon may be using it.
        with closing(read_database(path)) as database:
            (finding,) = database.execute("PRAGMA quick_check(1)").fetchone()
            (count,) = database.execute("SELECT count(*) FROM missions").fetchone()
    except StoreError as error:
        return problem("missions", *Fault.STORE_UNUSABLE(why=error))
    except sqlite3.Error as error:
        finding = str(error)
    finding = plain_text(finding)  # it may quote names in the file
    if finding == "ok":
        return ok("missions", f"{count} stored in {path}, intact")
    return problem("missions", *Fault.STORE_DAMAGED(path=path, why=finding), RESTART_BRIDGE)


def output_of(*command: str) -> str:
    """What a program prints, or empty if it is missing or hangs."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=5).stdout  # noqa: S603  # our own words
    except (OSError, subprocess.TimeoutExpired):
        return ""


def check_power(ask: Callable[..., str] = output_of) -> Checked | None:
    """Check for undervoltage: below 4.63 V a Pi slows down, loses USB devices and damages its card.

    None on a machine that does not measure it.
    """
    try:
        flags = int(ask("vcgencmd", "get_throttled").strip().removeprefix("throttled="), 16)
    except ValueError:
        return None  # not a Pi, or no permission
    if flags & _NOW:
        return problem("power", *Fault.LOW_VOLTAGE(when="is too low"))
    if flags & _SINCE_START:
        return note("power", *Fault.LOW_VOLTAGE(when="was too low since the start"))
    return ok("power", "no undervoltage since the start")
