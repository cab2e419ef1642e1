# SPDX-License-Identifier: GPL-3.0-or-later
"""The capture player gives the recorded replies to the recorded requests."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, MspParser, request
from protocols.uart_capture import UartAction, UartEvent
from simulator.commands.playback import CapturePlayer

STATUS, IDENT = request(Msp.STATUS), request(Msp.IDENT)


def reply(command: int, *payload: int) -> bytes:
    return MspFrame(Direction.REPLY, command, bytes(payload)).encode()


def wrote(at: float, data: bytes, speed: int | None = 115200) -> UartEvent:
    return UartEvent(at, speed, UartAction.WRITE, data)


def read(at: float, data: bytes, speed: int | None = 115200) -> UartEvent:
    return UartEvent(at, speed, UartAction.READ, data)


def opened(at: float) -> UartEvent:
    return UartEvent(at, 115200, UartAction.OPEN)


def closed(at: float) -> UartEvent:
    return UartEvent(at, 115200, UartAction.CLOSE)


class Listener:
    """Sends requests to a player started at an arbitrary time, and records the replies with their times."""

    def __init__(self, events: Sequence[UartEvent], tempo: float = 1.0) -> None:
        self.player = CapturePlayer(events, tempo)
        self.player.power_on_booted(1000.0)
        self.received: list[tuple[float, bytes]] = []
        self._now = 0.0

    def ask(self, at: float, data: bytes) -> None:
        self.listen(at)
        self.player.receive(data, 1000.0 + at)

    def listen(self, until: float) -> list[tuple[float, bytes]]:
        """The data received since the last call."""
        self.received = []
        while (wakeup := self.player.next_wakeup(1000.0 + self._now) - 1000.0) <= until:
            self._now = max(wakeup, self._now + 1e-6)
            data = self.player.advance(1000.0 + self._now)
            if data:
                self.received.append((round(self._now, 3), data))
        self._now = until
        return self.received


def test_a_reply_comes_on_request_with_its_delay_and_in_the_same_pieces() -> None:
    answer = reply(Msp.STATUS, 1, 2, 3)
    listener = Listener([opened(0.0), wrote(1.0, STATUS), read(1.01, answer[:4]), read(1.02, answer[4:])])
    assert listener.listen(2.0) == []
    listener.ask(2.5, STATUS)
    assert listener.listen(9.0) == [(2.51, answer[:4]), (2.52, answer[4:])]


def test_unsolicited_data_comes_at_its_time() -> None:
    heartbeat = bytes.fromhex("fe0900010000") + bytes(11)
    events = [opened(0.0), read(0.5, heartbeat), wrote(1.0, STATUS), read(1.001, b"\x55" + reply(Msp.STATUS) + b"\xaa")]
    assert Listener(events).listen(5.0) == [(0.5, heartbeat), (1.001, b"\x55\xaa")]


def test_requests_at_another_rate_get_the_state_of_that_time() -> None:
    events = [opened(0.0)]
    for number in range(10):
        events += [wrote(number, STATUS), read(number + 0.01, reply(Msp.STATUS, number))]
    listener = Listener(events)
    for at, number in ((0.2, 0), (0.6, 0), (3.3, 3), (3.4, 3), (8.0, 8), (30.0, 9), (31.0, 9)):
        listener.ask(at, STATUS)
        assert listener.listen(at + 0.1) == [(round(at + 0.01, 3), reply(Msp.STATUS, number))]


def test_unanswered_requests_stay_unanswered() -> None:
    events = [opened(0.0), wrote(1.0, IDENT), wrote(2.0, IDENT), read(2.01, reply(Msp.IDENT, 7))]
    listener = Listener(events)
    listener.ask(1.0, IDENT)
    listener.ask(1.5, IDENT)
    assert listener.listen(1.9) == []
    listener.ask(2.1, IDENT)
    assert listener.listen(3.0) == [(2.11, reply(Msp.IDENT, 7))]


def test_while_the_flight_controller_was_silent_nothing_is_answered() -> None:
    """STATUS was answered before it fell silent; during the silence only IDENT was sent."""
    events = [opened(0.0), wrote(0.5, STATUS), read(0.51, reply(Msp.STATUS))]
    events += [wrote(at, IDENT) for at in (1.0, 2.0, 3.0, 4.0)]
    events += [wrote(5.0, IDENT), read(5.01, reply(Msp.IDENT, 7))]
    listener = Listener(events)
    for at, is_answered in ((0.7, True), (2.5, False), (4.5, False), (5.5, True)):
        for question in (STATUS, request(Msp.ANALOG)):
            listener.ask(at, question)
            assert bool(listener.listen(at + 0.2)) == is_answered, at


def test_a_request_never_recorded_gets_an_error_frame() -> None:
    listener = Listener([opened(0.0), wrote(0.5, STATUS), read(0.51, reply(Msp.STATUS))])
    listener.ask(1.0, request(Msp.ANALOG))
    ((_, data),) = listener.listen(2.0)
    assert MspParser().feed(data) == [MspFrame(Direction.ERROR, Msp.ANALOG)]


def test_replies_follow_the_conversation_not_only_the_time() -> None:
    """A recorded BEGIN was refused once, then accepted: so is one that is sent much earlier."""
    begin = request(190, b"begin")
    events = [opened(0.0), wrote(0.1, STATUS), read(0.11, reply(Msp.STATUS))]
    events += [wrote(300.0, begin), read(300.05, reply(190, 1)), wrote(301.0, begin), read(301.05, reply(190, 0))]
    listener = Listener(events)
    for at, result in ((5.0, 1), (6.0, 0), (7.0, 0)):
        listener.ask(at, begin)
        assert listener.listen(at + 0.5) == [(at + 0.05, reply(190, result))]


def test_replies_in_a_window_belong_to_their_requests() -> None:
    """Chunks of the same command are told apart by contents and answered in order; one of them was lost."""
    chunks = [request(191, bytes((number,))) for number in range(4)]
    events = [opened(0.0), wrote(1.0, chunks[0] + chunks[1]), wrote(1.1, chunks[2])]
    events += [read(1.2, reply(191, 0) + reply(191, 1)), wrote(1.3, chunks[3]), wrote(1.5, chunks[2])]
    events += [read(1.6, reply(191, 3)), read(1.7, reply(191, 2))]
    listener = Listener(events)
    answers = {}
    for number in (3, 0, 1):
        listener.ask(10.0 + number if number < 3 else 9.0, chunks[number])
        answers[number] = [data for _, data in listener.listen(10.9 + number if number < 3 else 9.9)]
    assert answers == {3: [reply(191, 3)], 0: [reply(191, 0)], 1: [reply(191, 1)]}


def test_replies_never_overtake_each_other() -> None:
    slow, fast = request(190, b"slow"), request(190, b"fast")
    events = [opened(0.0), wrote(1.0, slow), read(1.5, reply(190, 1)), wrote(2.0, fast), read(2.01, reply(190, 2))]
    listener = Listener(events)
    listener.ask(5.0, slow + fast)
    assert b"".join(data for _, data in listener.listen(9.0)) == reply(190, 1) + reply(190, 2)


def test_the_speed_is_that_of_the_recorded_port() -> None:
    events = [opened(0.0), read(1.0, b"\x80\x80", 57600), read(2.0, b"$M", 115200)]
    listener = Listener(events)
    for at, baud in ((0.5, 115200), (1.5, 57600), (2.5, 115200), (99.0, 115200)):
        listener.listen(at)
        assert listener.player.baud == baud
    assert Listener([read(0.0, b"$M", None)]).player.baud == 115200


def test_a_closed_port_is_silent_and_its_times_are_reported() -> None:
    events = [opened(0.0), wrote(0.5, STATUS), read(0.51, reply(Msp.STATUS)), closed(2.0), opened(5.0), closed(9.0)]
    listener = Listener(events, tempo=2.0)
    assert listener.player.outages == [(1.0, 2.5)]
    assert listener.player.duration_s == 4.5
    listener.ask(0.5, STATUS)
    assert listener.listen(0.9) == [(0.505, reply(Msp.STATUS))]
    listener.ask(1.5, STATUS)
    assert listener.listen(2.0) == []


@given(st.data())
def test_recorded_data_is_replayed_byte_for_byte(data: st.DataObject) -> None:
    """With the same requests at the same times: noise, truncated frames, bursts."""
    frames = st.sampled_from([reply(Msp.STATUS, 1), reply(Msp.IDENT), reply(Msp.STATUS, 2), b"$M>", b"$", b"\xfe\x09"])
    actions = st.one_of(
        st.sampled_from([STATUS, IDENT, STATUS + IDENT]).map(lambda asked: (UartAction.WRITE, asked)),
        st.one_of(frames, st.binary(min_size=1, max_size=12)).map(lambda received: (UartAction.READ, received)),
    )
    drawn = data.draw(st.lists(st.tuples(st.integers(1, 200), actions), max_size=30))
    events, at = [opened(0.0)], 0.0
    for pause_ms, (action, content) in drawn:
        at += pause_ms / 1000
        events.append(UartEvent(at, 115200, action, content))
    events.append(closed(at + 1.0))
    listener = Listener(events)
    received = b""
    for event in events:
        if event.action is UartAction.WRITE:
            listener.ask(event.at, event.data)
            received += b"".join(piece for _, piece in listener.received)
    received += b"".join(piece for _, piece in listener.listen(at + 10))
    assert received == b"".join(event.data for event in events if event.action is UartAction.READ)


@pytest.mark.parametrize("rest", [[], [closed(2.002)], [closed(2.002), opened(2.5), wrote(2.6, IDENT)]])
def test_unanswered_requests_at_the_end_do_not_mean_silence(rest: list[UartEvent]) -> None:
    """The end of the recording or unplugging cut the replies off."""
    events = [opened(0.0), wrote(1.0, STATUS), read(1.01, reply(Msp.STATUS)), wrote(1.9, STATUS), wrote(2.0, IDENT)]
    listener = Listener([*events, *rest])
    listener.ask(1.95, STATUS)
    assert listener.listen(2.0) == [(1.96, reply(Msp.STATUS))]
    listener.ask(9.0, STATUS)
    assert listener.listen(9.5) == [(9.01, reply(Msp.STATUS))]


def test_unanswered_requests_before_the_end_mean_silence() -> None:
    events = [opened(0.0), wrote(1.0, STATUS), read(1.01, reply(Msp.STATUS)), wrote(2.0, STATUS), wrote(2.3, IDENT)]
    listener = Listener([*events, wrote(4.0, IDENT), closed(4.1)])
    listener.ask(3.0, STATUS)
    listener.ask(9.0, STATUS)
    assert listener.listen(19.0) == []
