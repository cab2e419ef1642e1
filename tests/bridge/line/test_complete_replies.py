# SPDX-License-Identifier: GPL-3.0-or-later
"""When all replies to the polls can have arrived: a read before that time would find a part of them."""

from math import inf

import pytest

from bridge.line.conversation import Send
from bridge.line.msp_link import MspLink, byte_time_s
from bridge.line.poll_schedule import PollSchedule
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
    # The board needs a moment for a request, too.
    assert NOW + first_request_s + 0.003 + len(replies) * BYTE_S <= complete_at
    assert complete_at <= NOW + (len(requests) + len(replies)) * BYTE_S + 0.005


def test_a_request_that_was_sent_later_is_answered_later() -> None:
    link = asking(poll(Msp.STATUS))
    later = NOW + 0.015
    link.send(poll(Msp.RC), later)
    assert link.complete_at >= later + (len(request(Msp.RC)) + len(reply(Msp.RC))) * BYTE_S


def test_only_the_rest_of_a_partial_reply_is_awaited() -> None:
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
        Send(request(Msp.RC), Msp.RC, frame_size(Msp.RC, 32), is_kept=True),
    ],
    ids=["a fast poll", "a conversation", "another program"],
)
def test_no_other_reply_is_read_late(urgent: Send) -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC)).complete_at > NOW
    assert asking(poll(Msp.STATUS), poll(Msp.RC), urgent).complete_at == -inf


def test_reads_at_once_while_a_reply_is_not_expected() -> None:
    link = asking(poll(Msp.STATUS), poll(Msp.RC))
    link.receive(reply(Msp.STATUS) + reply(Msp.RC), NOW + 0.01)
    assert link.complete_at == -inf


def test_a_line_without_a_speed_is_read_on_arrival() -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC), baud=None).complete_at == -inf


def test_a_slow_line_is_read_every_20_ms() -> None:
    assert asking(poll(Msp.STATUS), poll(Msp.RC), baud=2400).complete_at <= NOW + 0.05


def test_reads_at_once_while_a_request_waits_for_room() -> None:
    link = asking(poll(Msp.STATUS), poll(Msp.RC))
    link.send(Send(request(Msp.IDENT), Msp.IDENT, 224), NOW)
    assert link.awaits(Msp.IDENT)
    assert link.complete_at == -inf


def test_it_is_not_after_the_time_at_which_a_request_counts_as_lost() -> None:
    link = asking(poll(Msp.STATUS), poll(Msp.RC))
    lost_at = link.due
    link.receive(reply(Msp.STATUS)[:3], lost_at - 0.001)
    assert link.complete_at == lost_at


@pytest.mark.parametrize(("interval_s", "may_wait"), [(0.1, True), (0.05, False)])
def test_only_slow_polls_are_read_late(interval_s: float, *, may_wait: bool) -> None:
    """A client of fast ones needs fresh values."""
    link, polls = MspLink(BAUD, [], NOW), PollSchedule()
    polls.begin(BAUD)
    polls.want({Msp.ATTITUDE: interval_s})
    polls.ask(link, NOW, beside_missions=False)
    assert link.awaits(Msp.ATTITUDE)
    assert (link.complete_at > NOW) == may_wait
