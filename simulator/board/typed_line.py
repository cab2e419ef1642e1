# SPDX-License-Identifier: GPL-3.0-or-later
"""A line typed into a command line, echoed as Baseflight and its descendants do (cliProcess)."""

_DELETE = 0x7F
_ENTER = b"\r\n"


class TypedLine:
    """`size`: characters that fit. `rubs_out`: DEL removes one; without it a full line is echoed and not kept."""

    def __init__(self, size: int, *, rubs_out: bool = True) -> None:
        self._size = size
        self._rubs_out = rubs_out
        self._line = bytearray()

    def type(self, byte: int) -> tuple[bytes, str | None]:
        """Take a byte. Returns its echo, and the line when it ends. Empty lines are ignored."""
        if byte in _ENTER and self._line:
            line, self._line = self._line.decode("ascii"), bytearray()
            return b"\r\n", line
        if byte == _DELETE and self._rubs_out and self._line:
            self._line.pop()
            return b"\b \b", None
        is_full = len(self._line) == self._size
        if not ord(" ") <= byte <= ord("~") or (is_full and self._rubs_out) or (byte == ord(" ") and not self._line):
            return b"", None
        if not is_full:
            self._line.append(byte)
        return bytes((byte,)), None
