# SPDX-License-Identifier: GPL-3.0-or-later
"""The poll schedule: refused, unanswered and lost polls, and the line's limits on requested rates."""

import random
from collections import Counter
from collections.abc import Callable, Mapping
from math import inf

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.line.msp_link import MspLink
from bridge.line.poll_schedule import POLLS, PollSchedule
from protocols.msp.commands import Msp
from protocols.msp.frame import FRAME_OVERHEAD, Direction, MspFrame, MspParser

REPLY_PAYLOADS = {101: 11, 103: 16, 104: 16, 107: 5, 254: 8, 102: 18, 105: 16, 106: 14, 108: 8, 109: 6, 110: 5, 118: 12}
#: Maps a command to the size of the reply's payload; None: no reply, -1: an error.
Answer = Callable[[int], int | None]


def answer_all(command: int) -> int | None:
    return REPLY_PAYLOADS[command]


class Line:
    """A flight controller that answers after `delay_s` or not at all."""

    def __init__(
        self, baud: int | None = 115200, delay_s: float = 0.004, answer: Answer = answer_all, turn_s: float = 0.0
    ) -> None:
        self.now = 0.0
        self.schedule = PollSchedule()
        self.schedule.begin(baud, turn_s=turn_s)
        self.link = MspLink(baud, [], 0.0)
        self.asked: list[tuple[float, int]] = []
        self.answer = answer
        self.beside_missions = False
        self._delay_s = delay_s
        self._replies: list[tuple[float, bytes]] = []

    def run(self, seconds: float) -> Counter[int]:
        """Let time pass; return the number of polls by command."""
        end, before = self.now + seconds, len(self.asked)
        while self.now < end:
            due = [self.schedule.due(self.link), self.link.due, *(at for at, _ in self._replies)]
            self.now = min(max(min(due), self.now), end)
            while self._replies and self._replies[0][0] <= self.now:
                self._settle(self.link.receive(self._replies.pop(0)[1], self.now))
            self._settle(self.link.tick(self.now))
            self.schedule.ask(self.link, self.now, beside_missions=self.beside_missions)
            assert (
                self.link.outstanding_bytes <= 255 - 25
            )  # a Harakiri's ring, less a heartbeat that it may send unasked
            requests = [*self.link.output]
            self.link.output.clear()
            for data in requests:
                for frame in MspParser().feed(data):
                    self._take(frame.command)
        return Counter(command for _, command in self.asked[before:])

    def _settle(self, frames: list[MspFrame]) -> None:
        for frame in frames:
            if frame.command in self.schedule.commands:
                self.schedule.answered(frame)

    def _take(self, command: int) -> None:
        size: int | None = -1  # the link's own request
        if command in REPLY_PAYLOADS:
            self.asked.append((self.now, command))
            size = self.answer(command)
        if size is not None:
            direction = Direction.ERROR if size < 0 else Direction.REPLY
            frame = MspFrame(direction, command, bytes(max(size, 0))).encode()
            self._replies.append((self.now + self._delay_s, frame))


def test_everything_is_polled_at_the_start() -> None:
    line = Line()
    asked = line.run(0.2)
    assert set(asked) == {poll.command for poll in POLLS if poll.needed_s < inf}


def test_slower_polls_go_out_with_the_fastest() -> None:
    line = Line()
    line.schedule.want({Msp.ATTITUDE: 0.04, Msp.RAW_GPS: 0.2, Msp.ALTITUDE: 0.2, Msp.MOTOR: 0.5, Msp.RC: 0.5})
    line.run(5)
    before = len(line.asked)
    asked = line.run(20)
    assert len({at for at, _ in line.asked[before:]}) <= 26 * 20
    assert [round(asked[command] / 20) for command in (Msp.ATTITUDE, Msp.RAW_GPS, Msp.MOTOR)] == [25, 5, 2]


def test_polls_requested_at_different_times_go_out_together() -> None:
    line = Line()
    wanted = {}
    for command, interval_s in {Msp.ATTITUDE: 0.1, Msp.RAW_GPS: 0.2, Msp.ALTITUDE: 0.2, Msp.RC: 0.5}.items():
        wanted[command] = interval_s
        line.schedule.want(dict(wanted))
        line.run(1.07)
    before = len(line.asked)
    line.run(20)
    assert len({at for at, _ in line.asked[before:]}) <= 11 * 20


def test_a_refused_poll_is_tried_twice_per_flight_controller() -> None:
    line = Line(answer=lambda command: -1 if command == Msp.WP else REPLY_PAYLOADS[command])
    assert line.run(60)[Msp.WP] == 2
    assert line.schedule.interval_s(Msp.WP) is None
    line.schedule.want({Msp.WP: 0.1})
    assert line.run(10)[Msp.WP] == 0
    line.schedule.begin(115200)
    assert line.run(60)[Msp.WP] == 2


def test_a_single_error_is_treated_as_noise() -> None:
    noisy = [True]
    line = Line(answer=lambda command: -1 if command == Msp.WP and noisy and noisy.pop() else REPLY_PAYLOADS[command])
    assert line.run(60)[Msp.WP] >= 29


def test_an_unanswered_poll_slows_down_without_delaying_others() -> None:
    line = Line(answer=lambda command: None if command == Msp.RAW_GPS else REPLY_PAYLOADS[command])
    line.schedule.want({Msp.ATTITUDE: 0.04, Msp.RAW_GPS: 0.2})
    line.run(30)
    asked = line.run(60)
    assert asked[Msp.RAW_GPS] <= 14
    assert asked[Msp.ATTITUDE] / 60 == pytest.approx(25, rel=0.1)
    line.answer = answer_all
    line.run(20)
    assert line.run(10)[Msp.RAW_GPS] == pytest.approx(50, abs=3)


def test_a_poll_is_asked_again_soon_after_a_single_loss() -> None:
    line = Line()
    line.run(10.5)
    lost: list[float] = []

    def lose_one(command: int) -> int | None:
        if command == Msp.RAW_GPS and not lost:
            lost.append(line.now)
            return None
        return answer_all(command)

    line.answer = lose_one
    line.run(3)
    again = next(at for at, command in line.asked if command == Msp.RAW_GPS and at > lost[0])
    assert again - lost[0] < 0.4


@pytest.mark.parametrize(
    ("loss", "least", "most"), [(0.0, 1.0, 1.0), (0.01, 0.7, 1.0), (0.1, 0.2, 0.75), (0.5, 0.05, 0.2)]
)
def test_losses_lower_the_rates(loss: float, least: float, most: float) -> None:
    chance = random.Random(1)
    line = Line()
    line.schedule.want({Msp.ATTITUDE: 0.04, Msp.RAW_GPS: 0.2})
    line.run(10)
    whole_s = line.schedule.interval_s(Msp.ATTITUDE)
    assert whole_s is not None
    line.answer = lambda command: None if chance.random() < loss else REPLY_PAYLOADS[command]
    line.run(30)
    rates = []
    for _ in range(60):
        line.run(1)
        interval_s = line.schedule.interval_s(Msp.ATTITUDE)
        assert interval_s is not None
        rates.append(whole_s / interval_s)
    assert least <= sum(rates) / len(rates) <= most
    line.answer = answer_all
    line.run(60)
    assert line.schedule.interval_s(Msp.ATTITUDE) == pytest.approx(whole_s, rel=0.02)


@pytest.mark.parametrize("delay_s", [0.05, 0.1])
def test_on_a_slow_line_the_next_poll_waits_for_the_reply(delay_s: float) -> None:
    line = Line(None, delay_s)
    line.schedule.want({Msp.ATTITUDE: 0.04})
    line.run(10)
    asked = line.run(20)
    assert 0.5 / delay_s <= asked[Msp.ATTITUDE] / 20 <= 1 / delay_s + 0.1
    assert asked[Msp.STATUS] / 20 == pytest.approx(min(4, 1 / delay_s), rel=0.3)


@given(
    wishes=st.dictionaries(st.sampled_from([poll.command for poll in POLLS]), st.floats(0.01, 100.0)),
    baud=st.sampled_from([1200, 2400, 9600, 57600, 115200, None]),
    beside_missions=st.booleans(),
    turn_s=st.sampled_from([0.0, 0.01]),
)
@example(wishes=dict.fromkeys([poll.command for poll in POLLS], 0.02), baud=115200, beside_missions=False, turn_s=0.01)
def test_any_requests_fit_the_line_and_the_board(
    wishes: Mapping[Msp, float], baud: int | None, beside_missions: bool, turn_s: float
) -> None:
    line = Line(baud, turn_s=turn_s)
    line.beside_missions = beside_missions
    line.schedule.want(wishes)
    line.run(5)
    asked = line.run(20)
    used = sum(count * (REPLY_PAYLOADS[command] + 2 * FRAME_OVERHEAD) for command, count in asked.items()) / 20
    assert used <= (baud or 115200) / 10 * 0.6 * 1.1
    assert asked.total() / 20 * turn_s <= 0.6 * 1.1
    # Every requested poll is sent, and arming is noticed.
    wanted = {poll.command for poll in POLLS if poll.needed_s < 100} | {c for c, s in wishes.items() if s <= 5}
    assert set(asked) >= {command for command in wanted if wishes.get(command, 0) <= 5}
    assert asked[Msp.STATUS] / 20 >= (0.6 if baud == 1200 else 1.2)
