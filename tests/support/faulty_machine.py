# SPDX-License-Identifier: GPL-3.0-or-later
"""A machine made of files, as read by doctor's checks, with injected faults."""

import grp
import os
from contextlib import suppress
from pathlib import Path

from service.machine.host import Host
from service.settings.addresses import SerialFc

PORT = SerialFc("/dev/serial0", None)
_HEADER = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"


class FaultyMachine(Host):
    """Initially a Pi without problems; /dev/serial0 is a link to ttyAMA0."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.addresses = {"wlan0": "192.168.4.1"}
        self.write("/dev/ttyAMA0").chmod(0o660)
        self.owned_by("/dev/ttyAMA0", "dialout")
        self.path("/dev/serial0").symlink_to("ttyAMA0")
        self.write("/proc/cmdline", "console=tty1 root=/dev/mmcblk0p2 rootwait\n")
        self.write("/boot/firmware/cmdline.txt", "console=tty1 root=PARTUUID=1 rootwait\n")
        self.write("/sys/class/net/wlan0/wireless/x")
        self.write("/sys/class/net/eth0/x")
        self.write("/run/systemd/timesync/synchronized")
        self.write("/etc/os-release", 'ID=debian\nPRETTY_NAME="Debian GNU/Linux 12 (bookworm)"\n')
        self.sockets()

    def write(self, path: str, text: str = "") -> Path:
        file = self.path(path)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    def is_tty(self, device: str | Path) -> bool:
        """Only root could make character devices."""
        return str(device).startswith("/dev/tty") and self.path(device).is_file()

    def is_a(self, model: str, header: str) -> None:
        """Make it a Raspberry Pi with this UART on its header."""
        self.write("/proc/device-tree/model", f"{model}\0")
        self.write("/boot/firmware/config.txt", "[cm4]\notg_mode=1\n")
        self.write(f"/dev/{header}")
        self.path("/dev/serial0").unlink()
        self.path("/dev/serial0").symlink_to(header)

    def owned_by(self, path: str, group: str) -> None:
        """Give a file to a group. Only root and the group's members can: for other users it keeps theirs."""
        with suppress(PermissionError):
            os.chown(self.path(path), -1, grp.getgrnam(group).gr_gid)

    def runs(self, pid: int, *arguments: str, has_open: str = "") -> None:
        """Add a running program with an open file or socket."""
        self.write(f"/proc/{pid}/cmdline", "\0".join(arguments) + "\0")
        self.path(f"/proc/{pid}/fd").mkdir()
        if has_open:
            self.path(f"/proc/{pid}/fd/7").symlink_to(has_open)

    def sockets(self, udp: str = "", tcp: str = "") -> None:
        """Set the open sockets, in the format of /proc/net."""
        self.write("/proc/net/udp", _HEADER + udp)
        self.write("/proc/net/tcp", _HEADER + tcp)

    def address(self, interface: str) -> str | None:
        return self.addresses.get(interface)
