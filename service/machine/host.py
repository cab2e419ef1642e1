# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine, for doctor, setup and the port search: files below a root, which tests create."""

import os
import re
import shlex
import socket
import stat
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from storage.small_files import read_bounded

_SIOCGIFADDR = 0x8915
_MAX_BYTES = 1 << 20
_MOST_LINKS = 8
#: The programs of a login console.
LOGIN_PROGRAMS = ("agetty", "getty", "login")


@dataclass(frozen=True, slots=True)
class Process:
    """A running program. `arguments` includes the name."""

    pid: int
    arguments: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name} (pid {self.pid})"

    @property
    def name(self) -> str:
        """The program's file. Of Python the script or module."""
        words = [os.path.basename(word) for word in self.arguments] or [""]
        if not re.fullmatch(r"python[\d.]*", words[0]) or "-c" in words[1:3]:
            return words[0]
        return next((word for word in words[1:] if word and not word.startswith("-")), words[0])

    @property
    def is_naze_bridge(self) -> bool:
        """True for a naze-bridge daemon, under any Python."""
        return any("naze-bridge" in argument for argument in self.arguments[:4])


class Host:
    """Reads the machine whose files are below `root`."""

    def __init__(self, root: Path = Path("/")) -> None:
        self.root = root

    def path(self, path: str | Path) -> Path:
        """The real path of one of the machine's files."""
        return self.root / str(path).lstrip("/")

    def resolve(self, path: str | Path) -> Path:
        """The target of symbolic links, as a path on the machine. A later link that leads nowhere is not followed."""
        target = Path(path)
        for step in range(_MOST_LINKS):
            named = self.path(target)
            if not named.is_symlink():
                break
            following = Path(os.path.normpath(target.parent / os.readlink(named)))
            if step and not os.path.lexists(self.path(following)):
                break
            target = following
        return target

    def is_tty(self, device: str | Path) -> bool:
        """True for the character device of a serial port or terminal, by the kernel's list of their drivers."""
        try:
            status = self.path(device).lstat()
        except (OSError, ValueError):
            return False
        major, minor = os.major(status.st_rdev), os.minor(status.st_rdev)
        # Name, device, major number and minor numbers: "serial /dev/ttyS 4 64-95 serial".
        drivers = re.findall(r"^\S+ +\S+ +(\d+) +(\d+)(?:-(\d+))?\b", self.read("/proc/tty/drivers"), re.MULTILINE)
        is_listed = any(
            int(kind) == major and int(first) <= minor <= int(last or first) for kind, first, last in drivers
        )
        return stat.S_ISCHR(status.st_mode) and is_listed

    def read(self, path: str) -> str:
        """A file's text, or empty if it cannot be read."""
        try:
            return read_bounded(self.path(path), _MAX_BYTES).decode(errors="replace")
        except OSError:
            return ""

    def names(self, folder: str, pattern: str = "*") -> list[str]:
        return sorted(path.name for path in self.path(folder).glob(pattern))

    def processes(self) -> Iterator[Process]:
        """Yield the running programs, as far as permissions show them."""
        for name in self.names("/proc", "[0-9]*"):
            words = self.read(f"/proc/{name}/cmdline").split("\0")
            yield Process(int(name), tuple(words[:-1]))

    def holder(self, link: str) -> Process | None:
        """The program that has a file or socket open, by the descriptor's target ("/dev/ttyS0", "socket:[4711]")."""
        return next((process for process in self.processes() if self.has_open(process, link)), None)

    def stop_command(self, process: Process) -> str:
        """The command that ends a program for good: of a service the unit, which would start it again."""
        cgroup = self.read(f"/proc/{process.pid}/cgroup")
        found = re.search(r"/system\.slice/(?:[^/\n]*\.slice/)*([^/\n]+)\.service", cgroup)
        if found is None:
            return f"sudo kill {process.pid}"
        unit = shlex.quote(found[1])
        folders = ("/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system")
        has_socket = any(self.path(f"{folder}/{found[1]}.socket").exists() for folder in folders)
        return f"sudo systemctl disable --now {f'{unit}.socket ' if has_socket else ''}{unit}"

    def has_open(self, process: Process, link: str) -> bool:
        """True if a program has it open, as far as permissions show."""
        with suppress(OSError):
            return any(os.readlink(each) == link for each in self.path(f"/proc/{process.pid}/fd").iterdir())
        return False

    def has_login(self, terminal: str) -> bool:
        """True if a login console runs on a terminal, such as ttyS0.

        It does not take a lock: both programs could open the port, and each would lose half of the input.
        """
        return any(process.name in LOGIN_PROGRAMS and terminal in process.arguments[1:] for process in self.processes())

    def wifi_cards(self) -> list[str]:
        return [name for name in self.names("/sys/class/net") if self.path(f"/sys/class/net/{name}/wireless").exists()]

    def ipv4_addresses(self) -> list[str]:
        """The machine's IPv4 addresses except the loopback's, Wi-Fi first."""
        wifi = self.wifi_cards()
        cards = [*wifi, *(name for name in self.names("/sys/class/net") if name != "lo" and name not in wifi)]
        return [address for name in cards if (address := self.address(name)) is not None]

    def address(self, interface: str) -> str | None:
        """A network interface's IPv4 address, or None if it has none."""
        import fcntl  # Windows, where `naze-bridge card` runs too, has none

        request = struct.pack("256s", interface.encode()[:15])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
            try:
                return socket.inet_ntoa(fcntl.ioctl(asking.fileno(), _SIOCGIFADDR, request)[20:24])
            except OSError:
                return None
