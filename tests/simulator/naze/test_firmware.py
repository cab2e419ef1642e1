# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP as Harakiri implements it: lengths, peculiarities, and a receiver that never resynchronises."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.frame import Direction, request
from protocols.msp.mission import INFO_REQUEST
from simulator.board.options import Faults, SimOptions
from simulator.board.simulated_board import Power
from tests.support.naze_bench import BOOT_SECONDS, Bench

IDENT = request(100)
LENGTHS = {
    100: 7, 101: 11, 102: 18, 103: 16, 104: 16, 105: 16, 106: 14, 107: 5, 108: 8, 109: 6, 110: 5, 111: 7, 112: 30,
    113: 30, 114: 2, 115: 8, 200: 0, 201: 0, 202: 0, 203: 0, 204: 0, 205: 0, 206: 0, 207: 0, 208: 0, 250: 0, 254: 8,
}  # fmt: skip


def test_lengths_are_harakiris() -> None:
    stock = Faults(extension=False)
    assert {command: len(Bench(faults=stock).payload(request(command))) for command in LENGTHS} == LENGTHS


@pytest.mark.parametrize("command", [0, 1, 2, 3, 99, 119, 190, 199, 209, 253])
def test_requests_unknown_to_stock_firmware_are_errors_of_size_0(command: int) -> None:
    answer = Bench(faults=Faults(extension=False)).ask(request(command))
    assert answer is not None
    assert (answer.direction, answer.command, answer.payload) == (Direction.ERROR, command, b"")


@pytest.mark.parametrize("armed", [False, True])
def test_the_arm_bit_of_status_is_at_the_index_of_arm_in_boxnames(armed: bool) -> None:
    bench = Bench(faults=Faults(armed=armed))
    bench.run(0.01)
    names = bench.payload(request(116)).split(b";")
    assert names[-1] == b""
    flags = struct.unpack_from("<I", bench.payload(request(101)), 6)[0]
    assert bool(flags >> names.index(b"ARM") & 1) is armed


@pytest.mark.parametrize(("command", "seconds"), [(205, 9.4), (206, 61.0)])
def test_a_calibration_is_acknowledged_freezes_the_board_and_restarts_it(command: int, seconds: float) -> None:
    bench = Bench()
    assert bench.payload(request(command)) == b""
    assert bench.ask(IDENT, timeout=seconds - 0.2) is None
    assert bench.naze.counters.resets == 0
    bench.run(0.3)
    assert bench.naze.counters.resets == 1
    bench.run(BOOT_SECONDS)
    assert bench.ask(IDENT) is not None


def test_another_waypoint_is_answered_with_a_header_without_the_payload() -> None:
    bench = Bench()
    bench.send(request(118, b"\x01"))
    assert bench.run(0.2) == b"$M>" + bytes((12, 118, 12 ^ 118))


def test_after_a_truncated_frame_the_stock_receiver_swallows_the_next_frames() -> None:
    bench = Bench(faults=Faults(extension=False))
    bench.send(request(200, bytes(16))[:9])
    bench.run(1.0)
    assert bench.ask(IDENT, timeout=0.3) is None
    # 12 payload bytes and a checksum are missing: two IDENTs supply 12, the first byte of the third the last.
    assert bench.ask(IDENT, timeout=0.3) is None
    assert bench.ask(IDENT, timeout=0.3) is None
    assert bench.ask(IDENT, timeout=0.3) is not None


@pytest.mark.parametrize(("silence", "answers"), [(0.03, False), (0.08, True)])
def test_the_extension_drops_a_truncated_frame_after_50_ms(silence: float, answers: bool) -> None:
    bench = Bench()
    assert bench.ask(IDENT) is not None
    bench.send(request(200, bytes(16))[:9])
    bench.run(silence)
    assert (bench.ask(IDENT, timeout=0.02) is not None) is answers


@pytest.mark.parametrize(("extension", "size", "answers"), [
    (False, 64, True), (False, 65, False), (True, 243, True), (True, 244, False),
])  # fmt: skip
def test_the_receive_buffer_bounds_the_payload(extension: bool, size: int, answers: bool) -> None:
    bench = Bench(faults=Faults(extension=extension))
    assert bench.ask(IDENT) is not None
    # No '$' in the payload, so that a refused frame's bytes do not look like another frame.
    assert (bench.ask(request(205, b"\x11" * size), timeout=0.2) is not None) is answers


def test_a_reply_arrives_at_line_rate() -> None:
    bench = Bench(SimOptions(baud=9600))
    bench.send(IDENT)
    up, loop, down = 6 * 10 / 9600, 0.003, 13 * 10 / 9600
    bench.run(up + down - 10 / 9600)
    assert len(bench.received) < 13
    bench.run(loop + 10 / 9600 + 0.005)
    assert len(bench.received) == 13


def test_a_hung_board_is_silent_until_released() -> None:
    bench = Bench()
    bench.naze.faults.hang = True
    assert bench.ask(IDENT, timeout=3.0) is None
    bench.naze.faults.hang = False
    assert bench.next_frame(0.1) is not None


def test_input_during_a_hang_overflows_the_ring() -> None:
    bench = Bench()
    bench.naze.faults.hang = True
    bench.send(IDENT * 50)
    bench.run(1.0)
    bench.naze.faults.hang = False
    bench.run(0.1)
    assert bench.naze.counters.rx_overflows == 1


def test_too_many_requests_at_once_corrupt_the_replies() -> None:
    """Three replies to BOXNAMES exceed the ring, so a client has to limit pending replies."""
    bench = Bench(SimOptions(looptime_ms=9.0))
    bench.send(request(116) * 4)
    bench.run(0.5)
    assert bench.naze.counters.tx_overflows > 0
    assert bench.naze.counters.max_outstanding_reply_bytes > 255
    assert bench.received.count(b"ANGLE;HORIZON;BARO;") < 4


def test_an_unpowered_board_is_deaf_and_silent() -> None:
    bench = Bench()
    bench.naze.power_off(bench.now)
    assert bench.ask(IDENT, timeout=5.0) is None
    assert bench.received == b""
    assert bench.naze.power is Power.OFF


def test_input_beyond_the_ring_is_lost_during_boot() -> None:
    bench = Bench()
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(1.0)
    bench.send(IDENT * 44)
    bench.run(BOOT_SECONDS)
    assert bench.received.count(b"$M>") == 0
    assert bench.ask(IDENT) is not None


def test_a_waypoint_request_without_a_payload_uses_old_buffer_contents() -> None:
    bench = Bench(faults=Faults(extension=False))
    bench.payload(request(118, b"\x10"))
    assert bench.payload(request(118))[0] == 16
    bench.payload(request(118, b"\0"))
    assert bench.payload(request(118))[0] == 0


def test_p_of_roll_and_pitch_is_never_zero() -> None:
    bench = Bench()
    bench.payload(request(202, bytes(30)))
    assert bench.payload(request(112)) == bytes((1, 0, 0, 1)) + bytes(26)


def test_lost_bytes_and_flipped_bits_follow_the_seed() -> None:
    def talk(seed: int, faults: Faults) -> bytes:
        bench = Bench(SimOptions(seed=seed), faults)
        for _ in range(20):
            bench.send(IDENT)
            bench.run(0.05)
        return bytes(bench.received)

    clean = talk(1, Faults())
    for faults in (Faults(bit_error_rate=0.01), Faults(lost_byte_rate=0.03)):
        first, again, other = (talk(seed, faults) for seed in (1, 1, 2))
        assert first == again
        assert first not in (clean, other)


@given(
    st.lists(
        st.tuples(
            st.sampled_from([IDENT, request(101), request(116), INFO_REQUEST, request(200, bytes(16))[:9], b"$M<"]),
            st.floats(0.0001, 0.4),
        ),
        max_size=25,
    )
)
def test_reading_late_gives_the_same_bytes(schedule: list[tuple[bytes, float]]) -> None:
    """Read at each wake-up or once at the end, the bytes are the same."""
    punctual, late = Bench(), Bench()
    for data, pause in schedule:
        for bench in (punctual, late):
            bench.send(data)
        punctual.run(pause)
        late.now = punctual.now
    for bench in (punctual, late):
        bench.run(0.5)
    assert punctual.received == late.received


@given(st.binary(max_size=400))
def test_the_board_survives_any_bytes(data: bytes) -> None:
    bench = Bench()
    bench.send(data)
    bench.run(0.2)
    assert bench.naze.power in (Power.RUNNING, Power.CLI, Power.BOOTING)
