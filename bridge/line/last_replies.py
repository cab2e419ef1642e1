# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's last replies, as it sent them: other programs get them at no cost on the line."""

from protocols.msp.frame import MspFrame, request

#: Constant while the same board is connected: API_VERSION, FC_VARIANT, FC_VERSION, BOARD_INFO, BUILD_INFO, IDENT,
#: BOXNAMES, PIDNAMES, BOXIDS, UID.
_CONSTANT = frozenset(map(request, (1, 2, 3, 4, 5, 100, 116, 117, 119, 160)))
#: More than a board has commands; the rest are requests with an index, whose replies are current for a moment only.
_MOST = 256


class LastReplies:
    """The last reply to each request, including errors, by the request's frame."""

    def __init__(self) -> None:
        self._replies: dict[bytes, tuple[MspFrame, float]] = {}  # the one heard least recently first
        #: Constant replies that were heard twice: MSP's 8-bit checksum misses some damage.
        self._confirmed: dict[bytes, MspFrame] = {}

    def heard(self, asked: bytes, reply: MspFrame, now: float) -> None:
        before = self._replies.pop(asked, None)
        if asked in _CONSTANT and before is not None and before[0] == reply:
            self._confirmed[asked] = reply
        elif len(self._replies) >= _MOST:
            del self._replies[next(iter(self._replies))]
        self._replies[asked] = reply, now

    def get(self, asked: bytes, max_age_s: float, now: float) -> MspFrame | None:
        """The reply to a request if it is at most this old, or constant."""
        if (constant := self._confirmed.get(asked)) is not None:
            return constant
        reply, heard_at = self._replies.get(asked, (None, now))
        return reply if now <= heard_at + max_age_s else None

    def forget(self) -> None:
        """Forget all replies, because the board was changed."""
        self._replies.clear()
        self._confirmed.clear()
