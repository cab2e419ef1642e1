# SPDX-License-Identifier: GPL-3.0-or-later
"""The questions that identify an MSP board. Each is asked until two replies agree, and only once per identification."""

from collections.abc import Mapping

from bridge.line.conversation import Conversation, ask_surely
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.telemetry import Ident, decode_box_names, decode_ident
from protocols.plain_text import plain_text

_IDENT_SIZE = 7
_VARIANT_SIZE, _VERSION_SIZE = 4, 3
_MAX_REPLY_PAYLOAD = 200


class NoAnswer(Exception):
    """A request got no reply, so the board cannot be identified: a guess could be wrong."""


class Interview:
    """Asks a board about itself and remembers the replies. Every question may raise NoAnswer."""

    def __init__(self) -> None:
        self._replies: dict[int, MspFrame] = {}

    def ask(self, command: int, reply_payload: int, *, stable: int | None = None) -> Conversation[MspFrame]:
        """Ask `command`; the reply may be an error frame, which means that the board does not know it.

        stable: how many of its first bytes must agree, if the others may change at any moment.
        """
        if command not in self._replies:
            reply = yield from ask_surely(request(command), command, reply_payload, stable=stable)
            if reply is None:
                raise NoAnswer
            self._replies[command] = reply
        return self._replies[command]

    def ident(self) -> Conversation[Ident | None]:
        """IDENT; None on boards that have dropped it (INAV, Betaflight)."""
        return decode_ident((yield from self.ask(Msp.IDENT, _IDENT_SIZE)).payload)

    def variant(self) -> Conversation[str | None]:
        """FC_VARIANT, four letters; None on boards older than it."""
        reply = yield from self.ask(Msp.FC_VARIANT, _VARIANT_SIZE)
        return plain_text(reply.payload) if reply.direction is Direction.REPLY else None

    def version(self) -> Conversation[tuple[int, int, int] | None]:
        """FC_VERSION: major, minor and patch level."""
        reply = yield from self.ask(Msp.FC_VERSION, _VERSION_SIZE)
        if reply.direction is not Direction.REPLY or len(reply.payload) < _VERSION_SIZE:
            return None
        major, minor, patch = reply.payload[:_VERSION_SIZE]
        return major, minor, patch

    def box_names(self) -> Conversation[tuple[str, ...]]:
        """The box names, in the order of the status flags."""
        return decode_box_names((yield from self.ask(Msp.BOXNAMES, _MAX_REPLY_PAYLOAD)).payload)

    def boxes_by_id(self, names: Mapping[int, str]) -> Conversation[tuple[str, ...]]:
        """The same by permanent id, "" for ids not in `names`; with many boxes BOXNAMES outgrows a frame."""
        ids = (yield from self.ask(Msp.BOXIDS, _MAX_REPLY_PAYLOAD)).payload
        return tuple(names.get(number, "") for number in ids)
