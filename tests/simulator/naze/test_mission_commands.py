# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's side of docs/msp-mission.md, through the UART."""

import struct
from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.mission_item import ListIdentity, identify, pack_records
from protocols.msp.frame import apply_mask, request
from protocols.msp.mission import (
    ABORT_REQUEST,
    INFO_REQUEST,
    Info,
    InfoFlag,
    MissionCommand,
    ReplyStatus,
    Staged,
    Stored,
    WpRecord,
    decode_info,
    decode_records,
    encode_begin,
    encode_chunk,
    encode_commit,
    encode_read,
)
from simulator.board.options import Faults, SimOptions
from simulator.board.simulated_board import Power
from simulator.naze.replies import decode_radius, encode_radius
from tests.support.naze_bench import BOOT_SECONDS, Bench, mission

NOTHING = ListIdentity(0, 0)
LINE_RATE = 115200 / 10

records_of_any_kind = st.builds(
    WpRecord,
    lat_e7=st.integers(-900_000_000, 900_000_000),
    lon_e7=st.integers(-1_800_000_000, 1_800_000_000),
    height_m=st.integers(-32767, 32767),
    roi_heading=st.integers(0, 1),
    time=st.integers(0, 255),
    radius_m=st.integers(0, 255),
    turns=st.integers(-127, 127),
    command=st.integers(0, 7),
)


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


def raw(command: MissionCommand, body: bytes, mask: int = 0x41) -> bytes:
    """A request that the encoders would not produce."""
    return request(command, bytes((mask,)) + apply_mask(body, mask))


def test_info_has_the_boards_limits() -> None:
    assert info(Bench()) == Info(
        version=1,
        flags=InfoFlag(0),
        chunk_records=15,
        chunk_window=2,
        read_records=6,
        capacity=146,
        stored=NOTHING,
        wp_radius_cm=200,
        inter_byte_timeout_ms=50,
        staged=0,
        flash_writes=0,
    )


def test_without_the_extension_the_commands_are_unknown() -> None:
    bench = Bench(faults=Faults(extension=False))
    answer = bench.ask(INFO_REQUEST)
    assert answer is not None
    assert answer.payload == b""
    assert decode_info(answer.payload) is None


@settings(max_examples=40)
@given(st.lists(records_of_any_kind, max_size=146))
def test_a_pushed_list_reads_back_identical(records: list[WpRecord]) -> None:
    bench = Bench()
    if records:
        assert bench.push(records) == Stored(ReplyStatus.OK, identify(records))
    assert bench.pull() == records
    assert bench.naze.stored == pack_records(records)
    assert bench.naze.counters.hazard_runs == 0
    assert info(bench).stored == identify(records)


def test_a_full_list_survives_a_power_cycle() -> None:
    bench, records = Bench(), mission(146)
    bench.push(records)
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)
    assert bench.pull() == records
    assert info(bench).flash_writes == 1


def test_the_newer_of_two_lists_is_valid_after_boot() -> None:
    bench = Bench()
    for seed in range(5):
        bench.push(mission(10 + seed, seed))
        bench.naze.power_off(bench.now)
        bench.naze.power_on(bench.now)
        bench.run(BOOT_SECONDS + 0.1)
        assert bench.pull() == mission(10 + seed, seed)
    assert bench.naze.counters.flash_writes == 5


def test_an_identical_list_is_not_written_again() -> None:
    bench, records = Bench(), mission(12)
    bench.push(records)
    assert bench.progress(encode_begin(identify(records))) == Staged(ReplyStatus.SAME, 0, 0)
    assert not info(bench).flags
    assert bench.naze.counters.flash_writes == 1


def test_an_empty_list_clears() -> None:
    bench = Bench()
    bench.push(mission(3))
    assert bench.push([]) == Stored(ReplyStatus.OK, NOTHING)
    assert bench.pull() == []
    assert bench.progress(encode_begin(NOTHING)).status is ReplyStatus.SAME


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


def test_input_during_the_erase_overflows_the_receive_ring() -> None:
    bench = in_use(SimOptions(flash_erase_ms=100))
    bench.send(encode_begin(identify(mission(2))))
    bench.run(0.01)
    bench.send(request(100) * 100)
    bench.run(0.3)
    assert bench.naze.counters.rx_overflows == 1


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


# -- every request may be repeated ---------------------------------------------------------------------------


def test_begin_of_the_same_list_continues_and_of_another_starts_again() -> None:
    bench, records = Bench(), mission(20)
    bench.progress(encode_begin(identify(records)))
    standing = bench.progress(encode_chunk(pack_records(records), 0, 15).frame)
    assert standing == Staged(ReplyStatus.OK, 15, identify(records[:15]).checksum)
    assert bench.progress(encode_begin(identify(records))) == standing
    assert bench.progress(encode_begin(identify(mission(20, 1)))) == Staged(ReplyStatus.OK, 0, 0)


def test_a_repeated_chunk_is_ignored_and_the_reply_has_the_progress() -> None:
    bench, records = Bench(), mission(20)
    bench.progress(encode_begin(identify(records)))
    standing = bench.progress(encode_chunk(pack_records(records), 0, 10).frame)
    assert bench.progress(encode_chunk(pack_records(records), 0, 10).frame) == standing
    assert bench.progress(encode_chunk(pack_records(records), 5, 10).frame) == standing


def test_a_chunk_beyond_the_next_is_a_gap() -> None:
    bench, records = Bench(), mission(20)
    bench.progress(encode_begin(identify(records)))
    bench.progress(encode_chunk(pack_records(records), 0, 3).frame)
    expected = Staged(ReplyStatus.SEQUENCE, 3, identify(records[:3]).checksum)
    assert bench.progress(encode_chunk(pack_records(records), 5, 3).frame) == expected


def test_a_repeated_commit_and_abort_succeed() -> None:
    bench, records = Bench(), mission(4)
    bench.push(records)
    assert bench.stored(encode_commit(identify(records))) == Stored(ReplyStatus.OK, identify(records))
    for _ in range(2):
        assert bench.payload(ABORT_REQUEST) == bytes((ReplyStatus.OK,))
    assert bench.naze.counters.flash_writes == 1


# -- refusals ------------------------------------------------------------------------------------------------


def test_chunk_and_commit_need_a_transfer() -> None:
    bench, records = Bench(), mission(4)
    assert bench.progress(encode_chunk(pack_records(records), 0, 4).frame) == Staged(ReplyStatus.NO_TRANSFER, 0, 0)
    assert bench.stored(encode_commit(identify(records))) == Stored(ReplyStatus.NO_TRANSFER, NOTHING)


def test_five_seconds_of_silence_end_a_transfer() -> None:
    bench, records = Bench(), mission(4)
    bench.progress(encode_begin(identify(records)))
    bench.run(4.8)
    assert bench.progress(encode_chunk(pack_records(records), 0, 1).frame).status is ReplyStatus.OK
    for flags in (InfoFlag.TRANSFER_OPEN, InfoFlag.TRANSFER_OPEN, InfoFlag(0)):
        bench.run(1.8)
        assert info(bench).flags == flags
    assert bench.progress(encode_chunk(pack_records(records), 1, 1).frame).status is ReplyStatus.NO_TRANSFER


def test_a_list_over_the_capacity_is_refused() -> None:
    bench = Bench(SimOptions(capacity=5))
    assert bench.progress(encode_begin(ListIdentity(6, 1))).status is ReplyStatus.NO_SPACE
    assert bench.push(mission(5)).status is ReplyStatus.OK


def test_commit_of_an_incomplete_list_keeps_the_transfer() -> None:
    bench, records = Bench(), mission(7)
    bench.progress(encode_begin(identify(records)))
    bench.progress(encode_chunk(pack_records(records), 0, 3).frame)
    assert bench.stored(encode_commit(identify(records))) == Stored(ReplyStatus.INCOMPLETE, NOTHING)
    assert bench.progress(encode_chunk(pack_records(records), 3, 4).frame).status is ReplyStatus.OK
    assert bench.stored(encode_commit(identify(records))).status is ReplyStatus.OK


def test_a_list_with_another_checksum_is_not_committed() -> None:
    bench = Bench()
    bench.push(mission(3))
    records = mission(4, 1)
    announced = ListIdentity(4, identify(records).checksum ^ 1)
    bench.progress(encode_begin(announced))
    bench.progress(encode_chunk(pack_records(records), 0, 4).frame)
    assert bench.stored(encode_commit(announced)) == Stored(ReplyStatus.CHECKSUM, identify(mission(3)))
    assert bench.progress(encode_chunk(pack_records(records), 0, 4).frame).status is ReplyStatus.NO_TRANSFER


def test_a_record_with_an_unknown_command_drops_the_transfer() -> None:
    bench = Bench()
    records = [*mission(3), WpRecord(1, 2, 3, 0, 0, 2, 0, 8)]
    bench.progress(encode_begin(identify(records)))
    assert bench.progress(encode_chunk(pack_records(records), 0, 4).frame) == Staged(ReplyStatus.BAD_RECORD, 0, 0)
    assert bench.progress(encode_chunk(pack_records(records), 0, 3).frame).status is ReplyStatus.NO_TRANSFER


def test_failing_flash_drops_the_transfer_and_keeps_the_list() -> None:
    for failing in ("begin", "chunk", "commit"):
        bench, records = in_use(), mission(3, 1)
        bench.push(mission(2))
        if failing == "begin":
            bench.naze.faults.flash_failures = 1
            status = bench.progress(encode_begin(identify(records))).status
        elif failing == "chunk":
            bench.progress(encode_begin(identify(records)))
            bench.naze.faults.flash_failures = 1
            status = bench.progress(encode_chunk(pack_records(records), 0, 3).frame).status
        else:
            bench.stage(records)
            bench.naze.faults.flash_failures = 1
            status = bench.stored(encode_commit(identify(records))).status
        assert status is ReplyStatus.FLASH
        assert not info(bench).flags
        assert bench.pull() == mission(2)
        assert bench.push(records).status is ReplyStatus.OK


def test_arming_drops_the_transfer_and_refuses_writes_but_not_reads() -> None:
    bench, records = Bench(), mission(4)
    bench.push(records)
    bench.progress(encode_begin(identify(mission(4, 1))))
    bench.naze.faults.armed = True
    bench.run(0.01)
    assert info(bench).flags == InfoFlag.ARMED
    assert bench.progress(encode_begin(identify(mission(4, 1)))).status is ReplyStatus.ARMED
    assert bench.progress(encode_chunk(pack_records(mission(4, 1)), 0, 4).frame).status is ReplyStatus.ARMED
    assert bench.stored(encode_commit(identify(records))).status is ReplyStatus.ARMED
    assert bench.payload(encode_radius(300)) == struct.pack("<BH", ReplyStatus.ARMED, 200)
    assert bench.pull() == records
    bench.naze.faults.armed = False
    bench.run(0.01)
    assert bench.progress(encode_chunk(pack_records(mission(4, 1)), 0, 4).frame).status is ReplyStatus.NO_TRANSFER


def test_a_short_arming_drops_the_transfer_too() -> None:
    bench = Bench()
    bench.progress(encode_begin(identify(mission(4))))
    for armed in (True, False):
        bench.naze.faults.armed = armed
        bench.run(0.01)
    assert bench.progress(encode_chunk(pack_records(mission(4)), 0, 4).frame).status is ReplyStatus.NO_TRANSFER


@pytest.mark.parametrize("busy", [False, True])
def test_a_busy_board_replies_busy(busy: bool) -> None:
    bench = Bench(faults=Faults(busy=busy))
    assert bool(info(bench).flags & InfoFlag.WRITE_PENDING) is busy
    status = bench.progress(encode_begin(identify(mission(1)))).status
    assert status is (ReplyStatus.BUSY if busy else ReplyStatus.OK)


@pytest.mark.parametrize("frame", [
    request(MissionCommand.BEGIN),
    raw(MissionCommand.BEGIN, bytes(4)),
    raw(MissionCommand.BEGIN, bytes(5)),
    raw(MissionCommand.BEGIN, bytes((0, 0, 1, 0, 0, 0))),
    raw(MissionCommand.CHUNK, bytes(2)),
    raw(MissionCommand.CHUNK, bytes(2 + 8)),
    raw(MissionCommand.COMMIT, bytes(8)),
    request(MissionCommand.ABORT, b"\x00"),
    raw(MissionCommand.READ, bytes((0, 0, 0, 0))),
    raw(MissionCommand.READ, bytes((0, 0, 1, 1))),
    raw(MissionCommand.RADIUS, struct.pack("<HH", 300, 300)),
    raw(MissionCommand.RADIUS, bytes(2)),
])  # fmt: skip
def test_a_malformed_request_is_a_bad_request(frame: bytes) -> None:
    assert Bench().payload(frame)[0] == ReplyStatus.BAD_REQUEST


def test_a_chunk_with_too_many_records_is_a_bad_request() -> None:
    bench, records = Bench(SimOptions(chunk_records=15)), mission(20)
    small = Bench(SimOptions(chunk_records=4))
    for board, status in ((bench, ReplyStatus.OK), (small, None)):
        board.progress(encode_begin(identify(records)))
        answer = board.ask(encode_chunk(pack_records(records), 0, 10).frame, timeout=0.3)
        assert (answer and answer.payload[0]) == status


def test_reading_past_the_end_is_out_of_range() -> None:
    bench = Bench()
    bench.push(mission(4))
    answer = decode_records(bench.payload(encode_read(2, 6)))
    assert answer is not None
    assert (answer.status, answer.first, list(answer.records)) == (ReplyStatus.OK, 2, mission(4)[2:])
    assert bench.payload(encode_read(4, 1)) == struct.pack("<BH", ReplyStatus.RANGE, 4)


# -- gps_wp_radius -------------------------------------------------------------------------------------------


def test_a_radius_is_written_in_the_next_loop_which_stalls() -> None:
    bench = Bench()
    radius = decode_radius(bench.payload(encode_radius(350)))
    assert radius is not None
    assert (radius.status, radius.wp_radius_cm) == (ReplyStatus.OK, 350)
    begun = bench.now
    assert not info(bench).flags
    assert 0.15 < bench.now - begun < 0.25
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)
    assert info(bench).wp_radius_cm == 350


def test_writing_a_radius_keeps_an_open_transfer() -> None:
    bench = Bench()
    bench.progress(encode_begin(identify(mission(3))))
    bench.payload(encode_radius(350))
    bench.run(0.5)
    assert info(bench).flags == InfoFlag.TRANSFER_OPEN


def test_a_radius_not_yet_written_is_lost_in_a_power_cut() -> None:
    bench = Bench(SimOptions(config_write_delay_ms=1000))
    bench.payload(encode_radius(350))
    bench.run(0.9)
    assert info(bench).flags == InfoFlag.WRITE_PENDING
    assert bench.payload(encode_radius(360))[0] == ReplyStatus.BUSY
    assert bench.progress(encode_begin(identify(mission(1)))).status is ReplyStatus.BUSY
    bench.naze.power_off(bench.now)
    bench.naze.power_on(bench.now)
    bench.run(BOOT_SECONDS + 0.1)
    assert info(bench).wp_radius_cm == 200


@pytest.mark.parametrize(("radius", "status"), [(0, ReplyStatus.OK), (2000, ReplyStatus.OK), (2001, ReplyStatus.RANGE)])
def test_a_radius_above_20_m_is_out_of_range(radius: int, status: ReplyStatus) -> None:
    assert Bench().payload(encode_radius(radius))[0] == status


def test_the_same_radius_is_not_written_again() -> None:
    bench = Bench()
    assert bench.payload(encode_radius(200))[0] == ReplyStatus.OK
    assert not info(bench).flags


# -- power cuts ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("old", "operations"), [(0, 20 + 2), (9, 3 + 20 + 2)])
def test_a_power_cut_at_any_flash_operation_leaves_the_old_or_the_new_list(old: int, operations: int) -> None:
    """Cut the power during each erase, each record and the header; boot, check, and push again."""
    new = mission(20, 1)
    outcomes = []
    for operation in count(1):
        bench = Bench()
        if old:
            bench = in_use()
            bench.push(mission(old))
        bench.naze.faults.power_cut_at_flash_operation = operation
        bench.send(encode_begin(identify(new)))
        for index in range(20):
            bench.run(0.2)
            bench.send(encode_chunk(pack_records(new), index, 1).frame)
        bench.run(0.2)
        bench.send(encode_commit(identify(new)))
        bench.run(0.2)
        bench.naze.faults.power_cut_at_flash_operation = 0
        if bench.naze.power is not Power.OFF:
            break
        bench.naze.power_on(bench.now)
        bench.run(BOOT_SECONDS + 0.1)
        outcomes.append(bench.pull())
        assert bench.push(new).status is ReplyStatus.OK
        assert bench.pull() == new
    # Three erased pages, twenty records, the header, and its seal, which makes the new list valid.
    assert outcomes == [mission(old) if old else []] * operations
    assert bench.pull() == new


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


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), size=st.integers(1, 60))
def test_a_persistent_client_gets_a_list_through_a_bad_line(seed: int, size: int) -> None:
    """It repeats until answered and restarts when told to: never a wrong list, and finally the right one."""
    faults = Faults(bit_error_rate=2e-4, lost_byte_rate=1e-3)
    bench, records = Bench(SimOptions(seed=seed), faults), mission(size, seed)
    identity = identify(records)
    for _ in range(600):
        if bench.naze.power is Power.CLI or bench.naze.counters.resets:
            return  # rare: the line flipped a bit that completed a run
        bench.run(0.08)
        standing = info_or_none(bench)
        if standing is None:
            continue
        if standing.stored == identity:
            break
        if not standing.flags & InfoFlag.TRANSFER_OPEN:
            bench.ask(encode_begin(identity), timeout=0.5)
        elif standing.staged < size:
            bench.ask(encode_chunk(pack_records(records), standing.staged, 15).frame, timeout=0.1)
        else:
            bench.ask(encode_commit(identity), timeout=0.2)
    assert bench.naze.stored == pack_records(records)


def info_or_none(bench: Bench) -> Info | None:
    answer = bench.ask(INFO_REQUEST, timeout=0.1)
    return decode_info(answer.payload) if answer else None
