# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises a flight controller in its command line: it echoes requests, without unprintable bytes.

IDENT comes back as `$M<dd`; a looped-back line returns it whole. DEL erases a character of the typed
line. This applies to Harakiri (cli.c, tree TestCode3), Baseflight and INAV; HarakiriWebstore1 ignores DEL.
"""

_DEL = b"\x7f"
_UNPRINTABLE = bytes(byte for byte in range(256) if not ord(" ") <= byte <= ord("~"))
#: Exactly two requests: noise cannot produce that.
_EVIDENCE = 10
_TYPED_KEPT = 256
#: The longest line that can be typed: 64 characters on INAV, 48 on Harakiri.
RUB_OUT_LINE = _DEL * 64


def typed_and_rubbed_out(frame: bytes) -> bytes:
    """The frame, and the bytes that erase it from a command line."""
    return frame + _DEL * len(_printable(frame))


def _printable(data: bytes) -> bytes:
    return data.translate(None, _UNPRINTABLE)


class EchoWatch:
    """Compares received bytes with sent ones."""

    def __init__(self) -> None:
        self._typed = self._heard = b""

    def sent(self, frame: bytes) -> None:
        """Note a request."""
        self._typed = (self._typed + _printable(frame))[-_TYPED_KEPT:]

    def feed(self, data: bytes) -> None:
        """Take received bytes."""
        self._heard = (self._heard + data)[-_EVIDENCE:]

    def is_echo(self, size: int = _EVIDENCE) -> bool:
        """True if the last `size` bytes are our own requests."""
        return len(self._heard) >= size and self._heard[-size:] in self._typed
