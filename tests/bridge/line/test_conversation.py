# SPDX-License-Identifier: GPL-3.0-or-later
"""Questions to a board: how often they are repeated, and which reply is believed."""

from typing import Any

import pytest

from bridge.line.conversation import Conversation, Receive, ask, ask_status, ask_surely
from protocols.msp.frame import Direction, MspFrame, request

IDENT = 100


def reply(payload: bytes = b"x") -> MspFrame:
    return MspFrame(Direction.REPLY, IDENT, payload)


def carry_out(conversation: Conversation[Any], *answers: MspFrame | None) -> tuple[Any, int]:
    """The conversation's result, and how many requests it sent; None: a request is not answered."""
    left = list(answers)
    sent, answer = 0, None
    try:
        while True:
            effect = conversation.send(answer)
            assert isinstance(effect, Receive)
            sent += effect.request is not None
            answer = left.pop(0)
    except StopIteration as ended:
        return ended.value, sent


@pytest.mark.parametrize("lost", range(4))
def test_a_lost_reply_is_asked_for_again_but_not_forever(lost: int) -> None:
    result, sent = carry_out(ask(request(IDENT), IDENT, 7), *[None] * lost, reply())
    assert (result, sent) == ((reply(), lost + 1) if lost < 3 else (None, 3))


def test_a_reply_is_accepted_after_two_equal_readings() -> None:
    first, second = reply(b"a"), reply(b"b")
    assert carry_out(ask_surely(request(IDENT), IDENT, 1), first, second, second) == (second, 3)
    assert carry_out(ask_surely(request(IDENT), IDENT, 1), *[first, second] * 3) == (None, 5)


def test_bytes_that_may_change_are_not_compared() -> None:
    first, second = reply(b"AB1"), reply(b"AB2")
    assert carry_out(ask_surely(request(IDENT), IDENT, 3, stable=2), first, second) == (second, 2)


def test_a_status_that_is_too_short_is_unknown() -> None:
    assert carry_out(ask_status(tries=1), MspFrame(Direction.REPLY, 101, b"\1")) == (None, 1)
