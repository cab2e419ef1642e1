# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's conversations with the firmware's C core over bad lines, in simulated time."""

import random
from collections.abc import Callable
from itertools import count
from typing import Any

import pytest

from bridge.controllers.harakiri.mission_store import HarakiriMissions
from bridge.controllers.harakiri.profile import PATCHED
from bridge.fc.profile import FlightController, RuleSettings
from bridge.line.conversation import Conversation, StoreEffect
from bridge.line.msp_link import MspLink
from bridge.line.runner import Runner
from bridge.missions.fc_mission_store import PushResult
from bridge.model.vehicle import Vehicle
from protocols.mission_item import pack_records
from protocols.msp.frame import MspFrame
from protocols.msp.mission import MissionCommand, WpRecord, decode_info
from tests.support.c_core import CCore, PowerCut

_BAUD = 115200
_LOOP_S = 0.003
_BOOT_S = 0.5

Disturb = Callable[[bytes], bytes]


def mission(length: int, seed: int) -> tuple[WpRecord, ...]:
    """Records with every command and hazard bytes in many places."""
    rng = random.Random(seed)
    return tuple(
        WpRecord(
            lat_e7=rng.choice([0x0D0D0D0D, 0x23232323, rng.randint(-900_000_000, 900_000_000)]),
            lon_e7=rng.choice([0x52525252, rng.randint(-1_800_000_000, 1_800_000_000)]),
            height_m=rng.choice([13, 35, 82, rng.randint(-500, 500)]),
            roi_heading=rng.randint(0, 1),
            time=rng.randint(0, 255),
            radius_m=rng.randint(2, 255),
            turns=rng.randint(-127, 127),
            command=number % 8,
        )
        for number in range(length)
    )


OLDER, OLD, NEW = mission(146, 3), mission(140, 1), mission(146, 2)


def clean(data: bytes) -> bytes:
    return data


def bit_errors(rate: float, seed: int) -> Disturb:
    rng = random.Random(seed)
    return lambda data: bytes(byte ^ sum((rng.random() < rate) << bit for bit in range(8)) for byte in data)


def cut_frames(rate: float, seed: int) -> Disturb:
    rng = random.Random(seed)
    return lambda data: data[: rng.randrange(len(data))] if rng.random() < rate else data


class Line:
    """Runner, link, wire and board. Bytes arrive with the end of their frame."""

    def __init__(self, disturb: Disturb = clean) -> None:
        self.core = CCore()
        self.core.store(pack_records(OLDER))
        self.core.store(pack_records(OLD))
        self.core.power_cycle()
        info = decode_info(self.core.request(MissionCommand.INFO, b"") or b"")
        assert info is not None
        board = FlightController(PATCHED, PATCHED.name, info=info)
        self._missions = HarakiriMissions(board, Vehicle(), RuleSettings(takeoff_max_m=15))
        self.resets = 0
        self.now = 0.0
        self._disturb = disturb
        self._store_effects: list[StoreEffect] = []
        self._link = MspLink(_BAUD, [], self.now)
        self._link.receiver_timeout_s = info.inter_byte_timeout_ms / 1000
        self._runner = Runner(self._store_effects.append)
        self._runner.link_up(self._link)
        self._order = count()
        self._wire: list[tuple[float, int, Callable[[bytes], None], bytes]] = []
        self._wire_free = {True: 0.0, False: 0.0}
        self._board_ms = 0
        self._up_at = 0.0

    def run(self, conversation: Conversation[Any]) -> Any:
        """Run a conversation to its end."""
        results: list[Any] = []
        self._runner.start(conversation, lambda result, _: results.append(result), self.now)
        for _ in range(200_000):
            requests = [*self._link.output]
            self._link.output.clear()
            for frame in requests:
                self._carry(frame, to_board=True)
            if results:
                return results[0]
            self._step()
        raise AssertionError("the conversation does not end")

    def push(self, records: tuple[WpRecord, ...]) -> PushResult:
        result = self.run(self._missions.push(records, lambda _: None))
        assert isinstance(result, PushResult)
        return result

    def pull(self) -> Any:
        return self.run(self._missions.pull())

    def wait_for_boot(self) -> None:
        self.now = max(self.now, self._up_at)

    def _step(self) -> None:
        assert not self._store_effects
        due = [self._link.due, self._runner.due, *(at for at, *_ in self._wire[:1])]
        self.now = max(self.now, min(due))
        self._tell_the_board_the_time()
        while self._wire and self._wire[0][0] <= self.now:
            _, _, deliver, data = self._wire.pop(0)
            deliver(data)
        for reply in self._link.tick(self.now):
            self._take(reply)
        self._runner.tick(self.now)

    def _tell_the_board_the_time(self) -> None:
        elapsed = int(self.now * 1000) - self._board_ms
        self._board_ms += elapsed
        self.core.advance(elapsed)

    def _carry(self, data: bytes, *, to_board: bool) -> None:
        start = max(self.now, self._wire_free[to_board])
        at = self._wire_free[to_board] = start + len(data) * 10 / _BAUD
        deliver = self._board_receives if to_board else self._link_receives
        self._wire.append((at + (_LOOP_S if to_board else 0), next(self._order), deliver, self._disturb(data)))
        self._wire.sort(key=lambda entry: entry[:2])

    def _board_receives(self, data: bytes) -> None:
        if self.now < self._up_at:
            return
        try:
            replies = self.core.receive(data)
        except PowerCut:
            self.resets += 1
            self.core.power_cycle()
            self._up_at = self.now + _BOOT_S
            return
        if replies:
            self._carry(replies, to_board=False)

    def _link_receives(self, data: bytes) -> None:
        for reply in self._link.receive(data, self.now):
            self._take(reply)

    def _take(self, reply: MspFrame) -> None:
        if reply.command in self._runner.awaited_replies:
            self._runner.advance(reply, self.now)


def assert_whole(line: Line) -> None:
    assert line.core.list in (pack_records(OLD), pack_records(NEW))
    assert line.core.is_intact


def test_146_records_arrive_bit_for_bit_and_read_back() -> None:
    line = Line()
    assert line.push(NEW) == PushResult(None)
    assert line.core.list == pack_records(NEW)
    assert line.pull() == NEW
    assert line.push(NEW) == PushResult(None, unchanged=True)
    assert line.push(()) == PushResult(None)
    assert line.core.list == b""


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(("disturb", "rate"), [(bit_errors, 1e-3), (cut_frames, 0.2)])
def test_bad_lines_delay_records_without_changing_them(
    disturb: Callable[[float, int], Disturb], rate: float, seed: int
) -> None:
    line = Line(disturb(rate, seed))
    # Damage undetected by the XOR may turn a reply into a refusal, but never into a success.
    for _ in range(20):
        result = line.push(NEW)
        assert_whole(line)
        if result.failure is None:
            break
    assert line.core.list == pack_records(NEW)


@pytest.mark.parametrize("operation", [1, 2, 3, 4, 5, 124, 600, 1171, 1172, 1179, 1180])
def test_a_reset_during_a_flash_write_leaves_a_whole_list(operation: int) -> None:
    """Operations 1..3 erase; then come 8 half-words per record and 9 of the header."""
    line = Line()
    line.core.cut_power_at(operation)
    line.push(NEW)
    assert line.resets == 1
    assert_whole(line)
    line.wait_for_boot()
    assert line.push(NEW).failure is None
    assert line.core.list == pack_records(NEW)


def test_a_failed_flash_write_is_retried() -> None:
    line = Line()
    line.core.fail_at(50)
    assert line.push(NEW) == PushResult(None)
    assert line.core.list == pack_records(NEW)
