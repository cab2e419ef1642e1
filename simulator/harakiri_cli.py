# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's command line, as far as a companion meets it (cli.c): status, wpflush, save and exit.

Nothing is looked at before a whole line has been typed, and an empty line is none.
"""

from collections.abc import Callable
from enum import Enum, auto

PROMPT = b"\r\n# "
BANNER = b"\r\nEntering CLI Mode, type 'exit' or 'save' to return, or 'help' \r\n\r\n" + PROMPT
_LONGEST_LINE = 48
_ENTER = b"\r\n"


class CliRequest(Enum):
    """What a command asks of the firmware."""

    FLUSH = auto()
    SAVE = auto()
    REBOOT = auto()


class CommandLine:
    """Takes typed bytes. `status` gives the lines about the stored missions."""

    def __init__(self, status: Callable[[], str]) -> None:
        self._status = status
        self._line = bytearray()

    def type(self, byte: int) -> tuple[bytes, CliRequest | None]:
        """Take a byte; return what is printed and what the firmware has to do then."""
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
