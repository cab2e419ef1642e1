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
_SET_CLOCK = "sudo date --set 'YEAR-MONTH-DAY HOUR:MINUTE', with the present time"
_LEAST_FREE = 64 << 20
_LIBRARIES = ("pyserial", "eclipse-zenoh")
#: Bits of the reply: undervoltage now, and since the start.
_NOW, _SINCE_START = 1 << 0, 1 << 16
_BETTER_SUPPLY = "use the Pi's own supply or a BEC of 5.1 V and 3 A, with short, thick wires"


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
        return problem("clock", f"it is {time_text}, years in the past", _SET_CLOCK)
    if host.path(SYNCHRONIZED).exists():
        return ok("clock", f"{time_text}, set by the network")
    keeper = next((process.name for process in host.processes() if process.name in _TIME_PROGRAMS), None)
    if keeper is not None:
        return ok("clock", f"{time_text}, kept by {keeper}")
    remedy = f"connect to the Internet once, or before the flight: {_SET_CLOCK}"
    return note("clock", f"{time_text}, not set by the network since the start", remedy)


def check_root(host: Host) -> Checked | None:
    """Check that changes to the system survive a restart."""
    # The mount's own options do not count: those of the helper's unit make the root read-only for it.
    mounts = [line.partition(" - ")[::2] for line in host.read("/proc/self/mountinfo").splitlines()]
    disks = [disk.split() for mount, disk in mounts if mount.split()[4:5] == ["/"]]
    kind, _, options = (*disks[-1], "", "", "")[:3] if disks else ("", "", "")
    if kind == "overlay":
        remedy = "sudo raspi-config nonint disable_overlayfs && sudo reboot"
        return note("root", "an overlay in memory: settings, missions and logs are lost at power-off", remedy)
    if "ro" in options.split(","):
        remedy = "sudo mount -o remount,rw /; if that fails, the card may be worn out: look at `sudo dmesg`"
        return note("root", "read-only: settings and updates cannot be stored", remedy)
    return None


def check_disk(state_dir: Path, free_of: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free) -> Checked:
    folder = state_dir
    try:
        while not folder.exists():
            folder = folder.parent
        if not folder.is_dir():
            remedy = f"move {folder} away, or name another state_dir"
            return problem("disk", f"{state_dir} cannot be used: {folder} is a file", remedy)
        if not os.statvfs(folder).f_blocks:
            remedy = "name a folder on a disk as state_dir"
            return problem("disk", f"{state_dir} cannot be made: {folder} keeps no files", remedy)
        free = free_of(folder)
    except PermissionError:
        return note("disk", f"no permission to read {state_dir}", "run doctor with sudo")
    if os.statvfs(folder).f_flag & os.ST_RDONLY:
        remedy = "the card may be worn out: look at `sudo dmesg`, then sudo mount -o remount,rw /"
        return problem("disk", f"{folder} is on a disk that is read-only", remedy)
    if os.geteuid() and not os.access(folder, os.W_OK):
        return note("disk", f"no permission to write to {folder}", "run doctor with sudo")
    space = f"{free >> 20} MB free for {state_dir}"
    if free < _LEAST_FREE:
        return problem("disk", space, f"remove unneeded files, such as old logs: ls -l {state_dir}/logs")
    return ok("disk", space)


def check_database(state_dir: Path) -> list[Checked]:
    path = state_dir / DATABASE_NAME
    found = []
    try:
        exists = path.exists()
        aside = kept_aside(path)
    except PermissionError:
        return [note("missions", f"no permission to read {path}", "run doctor with sudo")]
    if not exists:
        found.append(ok("missions", f"none stored yet in {state_dir}"))
    else:
        found.append(_look_into(path))
    if aside:
        remedy = f"to save its readable part: sqlite3 {aside[-1]} .recover; then move it away"
        found.append(note("missions", f"a damaged store was kept as {aside[-1]}", remedy))
    return found


def _look_into(path: Path) -> Checked:
    try:
        # Read-only: a daemon may be using it.
        with closing(read_database(path)) as database:
            (finding,) = database.execute("PRAGMA quick_check(1)").fetchone()
            (count,) = database.execute("SELECT count(*) FROM missions").fetchone()
    except StoreError as error:
        return problem("missions", str(error), "move it away, and restart the bridge")
    except sqlite3.Error as error:
        finding = str(error)
    finding = plain_text(finding)  # it may quote names in the file
    if finding == "ok":
        return ok("missions", f"{count} stored in {path}, intact")
    remedy = "restart the bridge: it sets the file aside and begins a new one (sudo systemctl restart naze-bridge)"
    return problem("missions", f"{path} is damaged: {finding}", remedy, RESTART_BRIDGE)


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
        return problem("power", "the supply's voltage is too low", _BETTER_SUPPLY)
    if flags & _SINCE_START:
        return note("power", "the supply's voltage was too low since the start", _BETTER_SUPPLY)
    return ok("power", "no undervoltage since the start")
