# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's side of docs/msp-mission.md, through the UART."""

import pytest

from protocols.mission_item import ListIdentity, identify, pack_records
from protocols.msp.mission import (
    ABORT_REQUEST,
    INFO_REQUEST,
    Info,
    ReplyStatus,
    decode_info,
    encode_begin,
    encode_chunk,
    encode_commit,
)
from simulator.board.options import SimOptions
from simulator.board.simulated_board import Power
from simulator.naze.replies import encode_radius
from tests.support.naze_bench import BOOT_SECONDS, Bench, mission

NOTHING = ListIdentity(0, 0)
LINE_RATE = 115200 / 10


def info(bench: Bench) -> Info:
    found = decode_info(bench.payload(INFO_REQUEST))
    assert found is not None
    return found


def in_use(options: SimOptions | None = None) -> Bench:
    """A board with no blank slot."""
    bench = Bench(options)
    for seed in (3, 4):
        bench.push(mission(146, seed))
    return bench


def test_begin_stalls_for_the_erase_and_commit_does_not() -> None:
    bench = in_use(SimOptions(flash_erase_ms=300))
    before = bench.now
    bench.progress(encode_begin(identify(mission(2))))
    assert 0.300 < bench.now - before < 0.310
    assert bench.ask(ABORT_REQUEST)
    before = bench.now
    bench.progress(encode_begin(identify(mission(2))))
    assert bench.now - before < 0.010, "the slot is blank"
    before = bench.now
    bench.progress(encode_chunk(pack_records(mission(2)), 0, 1).frame)
    bench.progress(encode_chunk(pack_records(mission(2)), 1, 1).frame)
    bench.stored(encode_commit(identify(mission(2))))
    assert bench.now - before < 0.030


def test_a_window_of_two_chunks_fills_the_line() -> None:
    """From the first CHUNK to COMMIT's reply within 1.10 of the bare line time; the benchmark relies on it."""
    bench, records = Bench(), mission(146)
    bench.progress(encode_begin(identify(records)))
    start, first, outstanding, following = bench.now, 0, 0, 0
    while following < len(records):
        while outstanding < 2 and first < len(records):
            chunk = encode_chunk(pack_records(records), first, 15)
            bench.send(chunk.frame)
            first, outstanding = first + chunk.count, outstanding + 1
        answer = bench.next_frame()
        assert answer is not None
        following, outstanding = int.from_bytes(answer.payload[1:3], "little"), outstanding - 1
    assert bench.stored(encode_commit(identify(records))).status is ReplyStatus.OK
    assert 1.0 < (bench.now - start) / (146 * 16 / LINE_RATE) < 1.12
    assert bench.naze.counters.rx_overflows == 0


def test_a_chunk_with_too_many_records_is_a_bad_request() -> None:
    bench, records = Bench(SimOptions(chunk_records=15)), mission(20)
    small = Bench(SimOptions(chunk_records=4))
    for board, status in ((bench, ReplyStatus.OK), (small, None)):
        board.progress(encode_begin(identify(records)))
        answer = board.ask(encode_chunk(pack_records(records), 0, 10).frame, timeout=0.3)
        assert (answer and answer.payload[0]) == status


@pytest.mark.parametrize("operation", range(1, 5))
def test_a_power_cut_leaves_the_old_or_the_new_configuration(operation: int) -> None:
    """Its staged page is erased and programmed, then its place."""
    bench = Bench()
    bench.push(mission(7))
    bench.payload(encode_radius(350))
    bench.run(1.5)
    bench.payload(encode_radius(500))
    bench.naze.faults.power_cut_at_flash_operation = operation
    bench.run(1.5)
    assert bench.naze.power is Power.OFF
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)
    assert info(bench).wp_radius_cm == (350 if operation <= 2 else 500)
    assert bench.pull() == mission(7)
