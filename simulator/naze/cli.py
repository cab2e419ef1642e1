# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of Harakiri's command line that a companion may reach (cli.c)."""

from collections.abc import Callable
from enum import Enum, auto

from protocols.msp.command_line import PROMPT
from simulator.board.options import Tree
from simulator.board.typed_line import TypedLine

BANNER = b"\r\nEntering CLI Mode, type 'exit' or 'save' to return, or 'help' \r\n\r\n" + PROMPT


class CliRequest(Enum):
    """A command's request to the firmware."""

    FLUSH = auto()
    SAVE = auto()
    REBOOT = auto()
    FLASH_FIRMWARE = auto()


#: The board restarts after these.
LAST_REQUESTS = frozenset((CliRequest.SAVE, CliRequest.REBOOT, CliRequest.FLASH_FIRMWARE))


class CommandLine:
    """Takes typed bytes. `status` returns the lines about the stored missions, `dump` those about the settings."""

    def __init__(self, tree: Tree, status: Callable[[], str], dump: Callable[[], str]) -> None:
        self._status = status
        self._dump = dump
        self._line = TypedLine(48) if tree is Tree.TESTCODE3 else TypedLine(47, rubs_out=False)

    def type(self, byte: int) -> tuple[bytes, CliRequest | None]:
        """Take a byte. Returns the output and the request to the firmware."""
        echo, line = self._line.type(byte)
        if line is None:
            return echo, None
        text, asked = self._run(line)
        return echo + text.encode() + (b"" if asked in LAST_REQUESTS else PROMPT), asked

    def _run(self, line: str) -> tuple[str, CliRequest | None]:
        match line.split()[0].lower():
            case "status":
                return self._status(), None
            case "wpflush":
                return f"{self._status()}Flushing.\r\n\r\n", CliRequest.FLUSH
            case "save":
                return "Saving...\r\nRebooting...", CliRequest.SAVE
            case "dump":
                return self._dump(), None
            case "flash":
                return "Close terminal & flash\r\n", CliRequest.FLASH_FIRMWARE
            case "exit":
                return "\r\nLeaving CLI mode without saving\r\n\r\nRebooting...", CliRequest.REBOOT
        return "That was Harakiri, try 'help'", None
