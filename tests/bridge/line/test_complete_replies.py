# SPDX-License-Identifier: GPL-3.0-or-later
"""When all replies to the polls can have arrived: a read before that time would find a part of them."""

from math import inf

import pytest

from bridge.line.conversation import Send
from bridge.line.msp_link import MspLink, byte_time_s
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, frame_size, request
from protocols.msp.telemetry import STATUS_SIZE

BAUD = 115200
BYTE_S = byte_time_s(BAUD)
SIZES = {Msp.STATUS: STATUS_SIZE, Msp.RC: 32, Msp.ATTITUDE: 6}
NOW = 100.0


def poll(command: Msp, *, may_wait: bool = True) -> Send:
    return Send(request(command), command, frame_size(command, SIZES[command]), is_kept=True, may_wait=may_wait)


def reply(command: Msp) -> bytes:
    return MspFrame(Direction.REPLY, command, bytes(SIZES[command])).encode()


def asking(*polls: Send, baud: int | None = BAUD) -> MspLink:
    link = MspLink(baud, [], NOW)
    for each in polls:
        link.send(each, NOW)
    return link


def test_it_is_not_before_the_last_byte_can_be_there() -> None:
    requests, replies = request(Msp.STATUS) + request(Msp.RC), reply(Msp.STATUS) + reply(Msp.RC)
    complete_at = asking(poll(Msp.STATUS), poll(Msp.RC)).complete_at
    first_request_s = len(request(Msp.STATUS)) * BYTE_S
    assert NOW + first_request_s + len(replies) * BYTE_S <= complete_at
    # The board needs a moment for a request, too.
    assert complete_at <= NOW + (len(requests) + len(replies)) * BYTE_S + 0.005


def test_after_a_part_only_the_rest_is_waited_for() -> None:
    link = asking(poll(Msp.STATUS), poll(Msp.RC))
    later = NOW + 0.005
    link.receive(reply(Msp.STATUS) + reply(Msp.RC)[:5], later)
    assert link.complete_at == pytest.approx(later + (len(reply(Msp.RC)) - 5) * BYTE_S)


def test_a_few_bytes_are_read_on_arrival() -> None:
    link = asking(poll(Msp.RC))
    link.receive(reply(Msp.RC)[:-5], NOW + 0.002)
    assert link.complete_at == -inf


@pytest.mark.parametrize(
    "urgent",
    [
        poll(Msp.ATTITUDE, may_wait=False),
        Send(request(Msp.IDENT), Msp.IDENT, 13),
        Send(request(Msp.RC), Msp.RC, frame_size(Msp.RC, 32), is_kept=True, is_shared=True),
    ],
    ids=["a fast poll", "a conversation", "another program"],
)
def test_no_other_reply_is_read_late(urgent: Send) -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC)).complete_at > NOW
    assert asking(poll(Msp.STATUS), poll(Msp.RC), urgent).complete_at == -inf


def test_nothing_is_read_late_while_no_reply_is_awaited() -> None:
    link = asking(poll(Msp.STATUS), poll(Msp.RC))
    link.receive(reply(Msp.STATUS) + reply(Msp.RC), NOW + 0.01)
    assert link.complete_at == -inf


def test_a_line_without_a_speed_is_read_on_arrival() -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC), baud=None).complete_at == -inf


def test_a_slow_line_is_read_every_20_ms() -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC), baud=2400).complete_at <= NOW + 0.05
