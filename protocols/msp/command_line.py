# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line that shares the port with MSP: how a board in it is recognised, and left undisturbed.

In the command line a board echoes requests, without unprintable bytes: IDENT comes back as `$M<dd`. A looped-back line
returns it whole. DEL erases a character of the typed line. This applies to Harakiri (cli.c, tree TestCode3), Baseflight
and INAV; HarakiriWebstore1 ignores DEL.
"""

from collections import deque

#: Harakiri's, when it waits for a command.
PROMPT = b"\r\n# "

_DEL = b"\x7f"
_UNPRINTABLE = bytes(byte for byte in range(256) if not ord(" ") <= byte <= ord("~"))
_HEADER = b"$M<"
#: Exactly two requests: noise cannot produce that.
_EVIDENCE = 10
_FRAMES_KEPT = 64
#: Erases the longest line that can be typed: 64 characters on INAV, 48 on Harakiri.
RUB_OUT_LINE = _DEL * 64


def typed_and_rubbed_out(frame: bytes) -> bytes:
    """The frame, and the bytes that erase it from a command line."""
    return frame + _DEL * len(_printable(frame))


def _printable(data: bytes) -> bytes:
    return data.translate(None, _UNPRINTABLE)


class EchoWatch:
    """Compares received bytes with those sent. `sent`: the last requests."""

    def __init__(self) -> None:
        self.sent: deque[bytes] = deque(maxlen=_FRAMES_KEPT)
        self._heard = b""

    def feed(self, data: bytes) -> None:
        self._heard = (self._heard + data)[-_EVIDENCE - len(PROMPT) :]

    def is_echo(self, size: int = _EVIDENCE) -> bool:
        """True if the last `size` bytes are our own requests, with a header, or a header follows Harakiri's prompt."""
        tail = self._heard[-size:]  # a reply may quote a request's text, but not two
        is_sent = len(tail) == size and _HEADER in tail and tail in _printable(b"".join(self.sent))
        return is_sent or PROMPT + _HEADER in self._heard
