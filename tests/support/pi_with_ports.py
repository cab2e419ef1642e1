# SPDX-License-Identifier: GPL-3.0-or-later
"""A Raspberry Pi whose serial ports are pseudo-terminals."""

import os
import tty
from contextlib import suppress
from pathlib import Path

from tests.support.faulty_machine import FaultyMachine

CP2102 = ("10c4", "ea60", "Silicon Labs", "CP2102 USB to UART Bridge Controller")


class Pi(FaultyMachine):
    """A Raspberry Pi whose serial ports are pseudo-terminals."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.path("/dev/ttyAMA0").unlink()
        self.wires: dict[str, int] = {}

    def usb(self, name: str, socket: str, chip: tuple[str, str, str, str] = CP2102) -> None:
        """Plug a USB serial chip in, without a terminal."""
        device = f"/sys/devices/usb1/{socket}"
        for fact, text in zip(("idVendor", "idProduct", "manufacturer", "product"), chip, strict=True):
            self.write(f"{device}/{fact}", f"{text}\n")
        self.path(f"{device}/{socket}:1.0/{name}").mkdir(parents=True)
        self.path(f"/sys/class/tty/{name}").mkdir(parents=True)
        self.path(f"/sys/class/tty/{name}/device").symlink_to(self.path(f"{device}/{socket}:1.0/{name}"))

    def terminal(self, name: str) -> None:
        """Give a port a terminal; its other end is in `wires`."""
        wire, terminal = os.openpty()
        tty.setraw(terminal)
        os.set_blocking(wire, False)
        self.wires[name] = wire
        self.path(f"/dev/{name}").symlink_to(os.ttyname(terminal))

    def sent_to(self, name: str) -> bytes:
        with suppress(BlockingIOError):
            return os.read(self.wires[name], 4096)
        return b""
