# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise is never mistaken for a flight controller, even if it consists of frame headers.

Probability of a false verdict on uniform noise. MSP needs two equal answers to IDENT within half a second;
the shortest has six fixed bytes: 2^-48 at each position, twice. MAVLink needs a heartbeat with plausible
magic, length, number, CRC, version, type, autopilot and state (2^-59 at each position), or two frames of
known messages from one sender within a visit (2^-78 for each pair of positions).
"""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.fc.states.base import FcLine, PortOpened
from bridge.fc.states.searching import SPEEDS, Searching
from bridge.line.runner import Runner
from protocols.msp.frame import Direction, MspFrame, request

SIZE = 1 << 18
UNIFORM = bytes(range(256))
#: Bytes are drawn uniformly from each alphabet; a repeated byte is more likely.
ALPHABETS = {
    "uniform": UNIFORM,
    "half MSP preambles": UNIFORM + b"$M>" * 64 + b"$M!" * 21,
    "half MAVLink 1 magics": UNIFORM + b"\xfe" * 256,
    "half MAVLink 2 magics": UNIFORM + b"\xfd" * 256,
    "every frame header": UNIFORM + b"$M><!\xfe\xfd\x00\x64" * 28,
    "letters": b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ$>!<\r\n 0123456789",
    "two values": b"\x00\xff",
}


def begin(*speeds: int, good: tuple[int, ...] = ()) -> Searching:
    fc_line = FcLine(speeds, (), Runner(lambda _effect: None), lambda _frames, _kinds: None)
    fc_line.good_speeds.extend(good)
    return Searching(fc_line, PortOpened(), 0.0)


def listen(noise: bytes, search: Searching, chunk: int) -> set[int | None]:
    """Feed a search noise at line rate; return the speeds that it tried."""
    now = 0.0
    visited = set()
    for start in range(0, len(noise), chunk):
        visited.add(search.speed)
        now += chunk * 10 / (search.speed or 115200)
        search.receive(noise[start : start + chunk], now)
        search.tick(now)
        search.fc_line.output.clear()
        assert search.found is None, (start, search.found)
    return visited


@pytest.mark.parametrize("name", ALPHABETS)
def test_noise_is_inconclusive(name: str) -> None:
    draw = random.Random(name)
    noise = bytes(draw.choices(ALPHABETS[name], k=SIZE))
    visited = listen(noise, begin(*SPEEDS), 96)
    assert visited == set(SPEEDS)
    # At one speed throughout: the one that yields the most frames.
    listen(noise[SIZE // 2 :], begin(115200, good=(115200,)), 512)


@pytest.mark.parametrize("preamble", [b"$M>", b"$M!", b"$M<", b"\xfe", b"\xfd", b"\xfe\x09", b"\xfd\x09\x00"])
def test_noise_full_of_frame_headers_does_not_give_a_verdict(preamble: bytes) -> None:
    draw = random.Random(preamble)
    noise = b"".join(preamble + draw.randbytes(draw.randrange(1, 14)) for _ in range(15_000))
    listen(noise, begin(*SPEEDS), 200)


def test_damaged_mavlink_and_foreign_msp_requests_are_inconclusive() -> None:
    """Each MAVLink frame has one damaged byte; the requests are intact, from another companion on the same wire."""
    draw = random.Random(1)
    mavlink = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    noise = bytearray()
    for number in range(3000):
        mavlink.seq = number % 256
        heartbeat = bytearray(messages.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3).pack(mavlink))
        heartbeat[draw.randrange(len(heartbeat))] ^= 1 << draw.randrange(8)
        answer = bytearray(MspFrame(Direction.REPLY, 100, bytes((211, 3, 0, 0, 0, 0, 128))).encode())
        answer[draw.randrange(3, len(answer))] ^= 1 << draw.randrange(8)
        noise += heartbeat + answer + request(draw.choice((100, 101, 116)))
    listen(bytes(noise), begin(*SPEEDS), 200)


def test_a_single_answer_is_not_enough() -> None:
    search = begin(115200)
    for number in range(500):
        now = search.due
        # Each answer differs.
        answer = MspFrame(Direction.REPLY, 100, bytes((211, 3, 0, number % 256, number // 256, 0, 128)))
        search.receive(answer.encode(), now)
        search.tick(now)
    assert search.found is None
