# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises a flight controller at its command line: it echoes requests, without the bytes that cannot be printed.

IDENT comes back as `$M<dd`; a looped-back line returns it whole. DEL takes a character off the line that is being
typed. This holds for Harakiri (cli.c, tree TestCode3), Baseflight and INAV; HarakiriWebstore1 ignores DEL.
"""

_DEL = b"\x7f"
_UNPRINTABLE = bytes(byte for byte in range(256) if not ord(" ") <= byte <= ord("~"))
#: Two requests and no other byte: noise that happens to be this is impossible.
_EVIDENCE = 10
_TYPED_KEPT = 256
#: The longest line that can be typed: 64 characters on INAV, 48 on Harakiri.
RUB_OUT_LINE = _DEL * 64


def typed_and_rubbed_out(frame: bytes) -> bytes:
    """The frame, and what leaves a command line as it was before."""
    return frame + _DEL * len(_printable(frame))


def _printable(data: bytes) -> bytes:
    return data.translate(None, _UNPRINTABLE)


class EchoWatch:
    """Compares what is received with what was sent."""

    def __init__(self) -> None:
        self._typed = self._heard = b""

    def sent(self, frame: bytes) -> None:
        """Note a request."""
        self._typed = (self._typed + _printable(frame))[-_TYPED_KEPT:]

    def feed(self, data: bytes) -> None:
        """Take bytes as they come."""
        self._heard = (self._heard + data)[-_EVIDENCE:]

    def is_echo(self, size: int = _EVIDENCE) -> bool:
        """True if the last `size` bytes are requests of ours."""
        return len(self._heard) >= size and self._heard[-size:] in self._typed
