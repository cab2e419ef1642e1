# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine as doctor, setup and the search for a port see it: files below a root, which tests make."""

import fcntl
import os
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_SIOCGIFADDR = 0x8915


@dataclass(frozen=True, slots=True)
class Process:
    """A program that runs, its arguments first to last."""

    pid: int
    arguments: tuple[str, ...]

    @property
    def name(self) -> str:
        """The program's name without its folder."""
        return os.path.basename(self.arguments[0]) if self.arguments else ""

    @property
    def is_naze_bridge(self) -> bool:
        """Whether it is a daemon of ours, whichever Python runs it."""
        return any("naze-bridge" in argument for argument in self.arguments[:4])


class Host:
    """Reads the machine whose files are below `root`."""

    def __init__(self, root: Path = Path("/")) -> None:
        self.root = root

    def path(self, path: str | Path) -> Path:
        """Return where a file of the machine is."""
        return self.root / str(path).lstrip("/")

    def resolve(self, path: str | Path) -> Path:
        """Return what a link of the machine leads to, as the machine names it."""
        named = self.path(path)
        if not named.is_symlink():
            return Path(path)
        return Path(os.path.normpath(Path(path).parent / os.readlink(named)))

    def read(self, path: str) -> str:
        """Return a file's text; nothing if it cannot be read."""
        try:
            return self.path(path).read_text(errors="replace")
        except OSError:
            return ""

    def names(self, folder: str, pattern: str = "*") -> list[str]:
        """Return the names in a folder, sorted."""
        return sorted(path.name for path in self.path(folder).glob(pattern))

    def processes(self) -> Iterator[Process]:
        """Yield the programs that run, as far as we may see them."""
        for name in self.names("/proc", "[0-9]*"):
            words = self.read(f"/proc/{name}/cmdline").split("\0")
            yield Process(int(name), tuple(words[:-1]))

    def holder(self, link: str) -> Process | None:
        """Return who has a file or socket open, by what its descriptor leads to ("/dev/ttyS0", "socket:[4711]")."""
        return next((process for process in self.processes() if self.has_open(process, link)), None)

    def has_open(self, process: Process, link: str) -> bool:
        """Whether a program has it open, as far as we may see it."""
        try:
            open_files = list(self.path(f"/proc/{process.pid}/fd").iterdir())
            return any(os.readlink(descriptor) == link for descriptor in open_files)
        except OSError:
            return False

    def ipv4_addresses(self) -> list[str]:
        """Return this machine's IPv4 addresses but the loopback's, Wi-Fi first."""
        cards = [name for name in self.names("/sys/class/net") if name != "lo"]
        cards.sort(key=lambda name: not self.path(f"/sys/class/net/{name}/wireless").exists())
        return [address for name in cards if (address := self.address(name)) is not None]

    def address(self, interface: str) -> str | None:
        """Return a network card's IPv4 address. This is the kernel's word, not a file's."""
        request = struct.pack("256s", interface.encode()[:15])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
            try:
                return socket.inet_ntoa(fcntl.ioctl(asking.fileno(), _SIOCGIFADDR, request)[20:24])
            except OSError:
                return None
