# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of Harakiri's command line that a companion may reach (cli.c): status, wpflush, save and exit.

Commands take effect at the end of a line; empty lines are ignored.
"""

from collections.abc import Callable
from enum import Enum, auto

PROMPT = b"\r\n# "
BANNER = b"\r\nEntering CLI Mode, type 'exit' or 'save' to return, or 'help' \r\n\r\n" + PROMPT
_LONGEST_LINE = 48
_ENTER = b"\r\n"


class CliRequest(Enum):
    """A command's request to the firmware."""

    FLUSH = auto()
    SAVE = auto()
    REBOOT = auto()


class CommandLine:
    """Takes typed bytes. `status` returns the lines about the stored missions."""

    def __init__(self, status: Callable[[], str]) -> None:
        self._status = status
        self._line = bytearray()

    def type(self, byte: int) -> tuple[bytes, CliRequest | None]:
        """Take a byte; returns the output and the request to the firmware."""
        if byte in _ENTER and self._line:
            line, self._line = bytes(self._line), bytearray()
            text, asked = self._run(line.decode("ascii"))
            return b"\r\n" + text.encode() + (b"" if asked in _LAST_WORDS else PROMPT), asked
        if ord(" ") <= byte <= ord("~") and len(self._line) < _LONGEST_LINE and (self._line or byte != ord(" ")):
            self._line.append(byte)
            return bytes((byte,)), None
        return b"", None

    def _run(self, line: str) -> tuple[str, CliRequest | None]:
        match line.split()[0].lower():
            case "status":
                return self._status(), None
            case "wpflush":
                return f"{self._status()}Flushing.\r\n\r\n", CliRequest.FLUSH
            case "save":
                return "Saving...\r\nRebooting...", CliRequest.SAVE
            case "exit":
                return "\r\nLeaving CLI mode without saving\r\n\r\nRebooting...", CliRequest.REBOOT
        return "That was Harakiri, try 'help'", None


_LAST_WORDS = (CliRequest.SAVE, CliRequest.REBOOT)
