# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/msp-mission.md, tested on the firmware's C core and on the simulator's model of it.

The first half compares each with the page. In the second half both get the same long random conversations and must
reply with the same bytes.
"""

import struct
from collections.abc import Callable
from typing import TypeVar

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from protocols.mission_item import ListIdentity, identify, pack_records
from protocols.msp import mission as ext
from protocols.msp.frame import request
from protocols.msp.mission import Info, InfoFlag, MissionCommand, Records, ReplyStatus, Staged, Stored, WpRecord
from simulator.naze.replies import decode_radius, encode_radius
from tests.support.c_core import CCore, PowerCut
from tests.support.mission_devices import Device, model, simulated_core

T = TypeVar("T")
CAPACITY, CHUNK, READ = 146, 15, 6


def mission(count: int, seed: int = 0) -> tuple[WpRecord, ...]:
    """A list that contains every command."""
    return tuple(
        WpRecord(480_000_000 + 977 * n + seed, -110_000_000 - 13 * n, 13 + n, n & 1, n, 2, -n % 128, n % 8)
        for n in range(count)
    )


def known(value: T | None) -> T:
    assert value is not None
    return value


class Companion:
    """Requests and replies as objects; the length of every reply must be that on the page."""

    def __init__(self, device: Device) -> None:
        self.device = device

    def ask(self, frame: bytes, size: int | None = None) -> bytes:
        reply = known(self.device.request(frame[4], frame[5:-1]))
        assert size is None or len(reply) == size
        return reply

    def info(self) -> Info:
        return known(ext.decode_info(self.ask(ext.INFO_REQUEST)))

    def progress(self, frame: bytes) -> Staged:
        return known(ext.decode_progress(self.ask(frame, 7)))

    def begin(self, identity: ListIdentity) -> Staged:
        return self.progress(ext.encode_begin(identity))

    def chunk(self, records: tuple[WpRecord, ...], first: int, count: int = CHUNK) -> Staged:
        return self.progress(chunk_frame(first, pack_records(records[first : first + count])))

    def commit(self, identity: ListIdentity) -> Stored:
        return known(ext.decode_stored(self.ask(ext.encode_commit(identity), 7)))

    def abort(self) -> bytes:
        return self.ask(ext.ABORT_REQUEST)

    def read(self, first: int, count: int) -> Records:
        return known(ext.decode_records(self.ask(ext.encode_read(first, count))))

    def radius(self, centimetres: int) -> tuple[ReplyStatus, int]:
        radius = known(decode_radius(self.ask(encode_radius(centimetres))))
        return radius.status, radius.wp_radius_cm

    def stage(self, records: tuple[WpRecord, ...]) -> None:
        assert self.begin(identify(records)).status is ReplyStatus.OK
        for first in range(0, len(records), CHUNK):
            assert self.chunk(records, first).status is ReplyStatus.OK

    def push(self, records: tuple[WpRecord, ...]) -> None:
        self.stage(records)
        assert self.commit(identify(records)) == Stored(ReplyStatus.OK, identify(records))

    def holds(self, records: tuple[WpRecord, ...]) -> bool:
        return self.device.list == pack_records(records) and self.info().stored == identify(records)


def chunk_frame(first: int, records: bytes) -> bytes:
    """Encode a CHUNK unmasked, as the page allows (hazards do not matter here)."""
    return request(MissionCommand.CHUNK, b"\0" + struct.pack("<H", first) + records)


OLD, NEW = mission(4, seed=1), mission(20, seed=2)
#: In the other slot, so that BEGIN has to erase.
OLDER = mission(CAPACITY, seed=3)
NOTHING = Staged(ReplyStatus.OK, 0, 0)


@pytest.fixture(params=[CCore, model, simulated_core])
def fc(request: pytest.FixtureRequest) -> Companion:
    companion = Companion(request.param())
    companion.push(OLDER)
    companion.push(OLD)
    return companion


# -- the page ------------------------------------------------------------------------------------------


def test_info_has_limits_and_state(fc: Companion) -> None:
    assert fc.begin(identify(NEW)) == NOTHING
    fc.chunk(NEW, 0)
    fc.device.set_busy(True)
    assert fc.info() == Info(
        version=1,
        flags=InfoFlag.WRITE_PENDING | InfoFlag.TRANSFER_OPEN,
        chunk_records=CHUNK,
        chunk_window=2,
        read_records=READ,
        capacity=CAPACITY,
        stored=identify(OLD),
        wp_radius_cm=200,
        inter_byte_timeout_ms=50,
        staged=CHUNK,
        flash_writes=2,
    )
    fc.device.arm(True)
    assert fc.info().flags == InfoFlag.ARMED | InfoFlag.WRITE_PENDING


def test_a_full_list_is_pushed_read_back_and_survives_a_reset(fc: Companion) -> None:
    records = mission(CAPACITY)
    fc.push(records)
    fc.device.power_cycle()
    read: list[WpRecord] = []
    while len(read) < CAPACITY:
        reply = fc.read(len(read), READ)
        assert (reply.status, reply.first) == (ReplyStatus.OK, len(read))
        read += reply.records
    assert tuple(read) == records
    assert fc.info().stored == identify(records)


def test_a_count_of_0_clears(fc: Companion) -> None:
    fc.push(())
    assert fc.holds(())
    fc.device.power_cycle()
    assert fc.holds(())


def test_a_stored_list_is_not_written_again(fc: Companion) -> None:
    writes = fc.info().flash_writes
    assert fc.begin(identify(OLD)).status is ReplyStatus.SAME
    assert InfoFlag.TRANSFER_OPEN not in fc.info().flags
    assert fc.info().flash_writes == writes


def test_requests_may_be_repeated(fc: Companion) -> None:
    half = identify(NEW[:CHUNK])
    fc.begin(identify(NEW))
    for _ in range(2):
        assert fc.chunk(NEW, 0) == Staged(ReplyStatus.OK, CHUNK, half.checksum)
        assert fc.begin(identify(NEW)) == Staged(ReplyStatus.OK, CHUNK, half.checksum)
    assert fc.chunk(NEW, 10, 10) == Staged(ReplyStatus.OK, CHUNK, half.checksum)
    fc.chunk(NEW, CHUNK)
    for _ in range(2):
        assert fc.commit(identify(NEW)) == Stored(ReplyStatus.OK, identify(NEW))
        assert fc.abort() == bytes((ReplyStatus.OK,))
    assert fc.holds(NEW)


def test_another_begin_replaces_the_transfer(fc: Companion) -> None:
    fc.begin(identify(OLD[:2]))
    fc.chunk(OLD, 0, 2)
    assert fc.begin(identify(NEW)) == NOTHING
    assert fc.info().staged == 0


def test_a_chunk_too_early_is_out_of_sequence(fc: Companion) -> None:
    fc.begin(identify(NEW))
    fc.chunk(NEW, 0, 3)
    assert fc.chunk(NEW, 4) == Staged(ReplyStatus.SEQUENCE, 3, identify(NEW[:3]).checksum)


def test_a_chunk_past_the_announced_count_is_refused(fc: Companion) -> None:
    fc.begin(identify(NEW[:5]))
    assert fc.chunk(NEW, 0, 6).status is ReplyStatus.RANGE
    assert fc.info().staged == 0
    assert fc.chunk(NEW, 0, 5).status is ReplyStatus.OK


def test_without_a_transfer_chunks_are_refused(fc: Companion) -> None:
    assert fc.chunk(NEW, 0) == Staged(ReplyStatus.NO_TRANSFER, 0, 0)
    assert fc.commit(identify(NEW)) == Stored(ReplyStatus.NO_TRANSFER, identify(OLD))


def test_more_records_than_the_capacity_are_refused_with_no_space(fc: Companion) -> None:
    assert fc.begin(ListIdentity(CAPACITY + 1, 1)) == Staged(ReplyStatus.NO_SPACE, 0, 0)


def test_commit_of_an_incomplete_list_is_incomplete(fc: Companion) -> None:
    fc.begin(identify(NEW))
    fc.chunk(NEW, 0)
    assert fc.commit(identify(NEW)) == Stored(ReplyStatus.INCOMPLETE, identify(OLD))
    assert InfoFlag.TRANSFER_OPEN in fc.info().flags


def test_commit_of_records_other_than_announced_is_a_checksum_error(fc: Companion) -> None:
    wrong = ListIdentity(len(NEW), 7)
    fc.begin(wrong)
    fc.chunk(NEW, 0)
    fc.chunk(NEW, CHUNK)
    assert fc.commit(wrong) == Stored(ReplyStatus.CHECKSUM, identify(OLD))
    assert fc.commit(wrong).status is ReplyStatus.NO_TRANSFER
    assert fc.holds(OLD)


def test_commit_of_a_list_other_than_begun_is_a_checksum_error(fc: Companion) -> None:
    fc.stage(NEW)
    assert fc.commit(identify(NEW[:3])).status is ReplyStatus.CHECKSUM
    assert fc.info().flags == InfoFlag(0)


def test_an_unknown_record_command_drops_the_transfer(fc: Companion) -> None:
    fc.begin(identify(NEW))
    bad = pack_records(NEW[:3])[:-1] + b"\x08"
    assert fc.progress(chunk_frame(0, bad)) == Staged(ReplyStatus.BAD_RECORD, 0, 0)
    assert fc.chunk(NEW, 0).status is ReplyStatus.NO_TRANSFER


def test_arming_drops_the_transfer_and_refuses_changes(fc: Companion) -> None:
    fc.stage(NEW)
    fc.device.arm(True)
    assert fc.begin(identify(NEW)) == Staged(ReplyStatus.ARMED, 0, 0)
    assert fc.chunk(NEW, 0) == Staged(ReplyStatus.ARMED, 0, 0)
    assert fc.commit(identify(NEW)) == Stored(ReplyStatus.ARMED, identify(OLD))
    assert fc.radius(500) == fc.radius(2001) == (ReplyStatus.ARMED, 200)
    assert fc.begin(ListIdentity(0, 1)).status is ReplyStatus.BAD_REQUEST
    assert fc.read(0, READ).records == list(OLD)
    fc.device.arm(False)
    assert fc.commit(identify(NEW)).status is ReplyStatus.NO_TRANSFER
    assert fc.holds(OLD)


def test_a_scheduled_configuration_write_makes_it_busy(fc: Companion) -> None:
    fc.device.set_busy(True)
    assert fc.begin(identify(NEW)) == Staged(ReplyStatus.BUSY, 0, 0)
    fc.device.set_busy(False)
    fc.push(NEW)


def test_five_seconds_of_silence_drop_the_transfer(fc: Companion) -> None:
    fc.begin(identify(NEW))
    fc.device.advance(5000)
    fc.chunk(NEW, 0)
    fc.device.advance(5000)
    assert InfoFlag.TRANSFER_OPEN in fc.info().flags
    fc.device.advance(1)
    assert fc.chunk(NEW, CHUNK).status is ReplyStatus.NO_TRANSFER


def test_reading_past_the_end_is_out_of_range(fc: Companion) -> None:
    assert fc.read(len(OLD), 1) == Records(ReplyStatus.RANGE, len(OLD), [])
    assert fc.read(len(OLD) - 1, READ).records == list(OLD[-1:])
    assert fc.read(0, 255).records == list(OLD)
    assert fc.read(0, 0).status is ReplyStatus.BAD_REQUEST


def test_the_radius_is_set_saved_and_bounded(fc: Companion) -> None:
    assert fc.radius(2001) == (ReplyStatus.RANGE, 200)
    assert fc.radius(2000) == (ReplyStatus.OK, 2000)
    assert InfoFlag.WRITE_PENDING in fc.info().flags
    assert fc.begin(identify(NEW)).status is ReplyStatus.BUSY
    assert fc.radius(100) == (ReplyStatus.BUSY, 2000)
    assert fc.radius(2000) == (ReplyStatus.OK, 2000)
    fc.device.advance(1000)
    fc.device.power_cycle()
    assert fc.info().wp_radius_cm == 2000


def test_malformed_requests_have_no_effect(fc: Companion) -> None:
    fc.begin(identify(NEW))
    fc.chunk(NEW, 0, 1)
    before = fc.info()
    lengths = {MissionCommand.ABORT: 1, MissionCommand.READ: 3, MissionCommand.RADIUS: 3}
    for size in range(244):
        # On a UART all of this takes longer than the timeout of a silent transfer.
        fc.begin(identify(NEW))
        well_formed = {
            MissionCommand.BEGIN: size == 7,
            MissionCommand.CHUNK: size > 3 and (size - 3) % 16 == 0,
            MissionCommand.COMMIT: size == 7,
            MissionCommand.ABORT: size == 0,
            MissionCommand.READ: size == 5,
            MissionCommand.RADIUS: size == 5,
        }
        for command in well_formed:
            if not well_formed[command]:
                reply = known(fc.device.request(command, bytes(size)))
                assert reply[0] == ReplyStatus.BAD_REQUEST
                assert len(reply) == lengths.get(command, 7)
    assert fc.begin(ListIdentity(0, 1)).status is ReplyStatus.BAD_REQUEST
    assert fc.info() == before


def test_other_commands_are_left_to_the_firmware(fc: Companion) -> None:
    assert fc.device.request(189, b"") is None
    assert fc.device.request(199, b"") is None


def begin_until_refused(fc: Companion) -> tuple[int, ReplyStatus]:
    """Begin lists and stage one record of each, so that each BEGIN has to erase."""
    for count in range(1000):
        status = fc.begin(ListIdentity(len(NEW), count)).status
        if status is not ReplyStatus.OK:
            return count, status
        assert fc.chunk(NEW, 0, 1).status is ReplyStatus.OK
    raise AssertionError("nothing is ever refused")


def test_a_blank_slot_does_not_need_an_erase(fc: Companion) -> None:
    assert fc.begin(identify(NEW)).status is ReplyStatus.OK
    fc.device.cut_power_at(1)  # the next flash operation
    for records in (OLDER, NEW) * 100:
        assert fc.begin(identify(records)).status is ReplyStatus.OK


def test_flash_writes_are_limited(fc: Companion) -> None:
    fc.device.power_cycle()
    assert begin_until_refused(fc) == (250, ReplyStatus.BUSY)
    assert fc.info().flags == InfoFlag.WRITES_SPENT
    assert fc.begin(identify(OLD)).status is ReplyStatus.SAME
    assert fc.radius(300) == (ReplyStatus.BUSY, 200)
    assert fc.radius(200) == (ReplyStatus.OK, 200)
    assert fc.holds(OLD)
    fc.device.advance(299_999)
    assert begin_until_refused(fc) == (0, ReplyStatus.BUSY)
    fc.device.advance(1)
    assert fc.info().flags == InfoFlag(0)
    fc.push(NEW)
    assert fc.holds(NEW)
    assert begin_until_refused(fc) == (0, ReplyStatus.BUSY)
    fc.device.advance(3 * 300_000)
    assert fc.radius(300) == (ReplyStatus.OK, 300)
    fc.device.advance(1000)
    assert begin_until_refused(fc) == (2, ReplyStatus.BUSY)
    fc.device.advance(1000 * 300_000)
    assert begin_until_refused(fc) == (250, ReplyStatus.BUSY)
    fc.device.power_cycle()
    assert begin_until_refused(fc) == (250, ReplyStatus.BUSY)


def begin_new(fc: Companion) -> ReplyStatus:
    return fc.begin(identify(NEW)).status


def first_chunk(fc: Companion) -> ReplyStatus:
    return fc.chunk(NEW, 0).status


def commit_new(fc: Companion) -> ReplyStatus:
    return fc.commit(identify(NEW)).status


STAGES: dict[Callable[[Companion], ReplyStatus], Callable[[Companion], object]] = {
    begin_new: lambda fc: None,
    first_chunk: begin_new,
    commit_new: lambda fc: fc.stage(NEW),
}


@pytest.mark.parametrize("act", STAGES)
def test_failing_flash_leaves_the_old_list(fc: Companion, act: Callable[[Companion], ReplyStatus]) -> None:
    STAGES[act](fc)
    fc.device.fail_at(1)
    assert act(fc) is ReplyStatus.FLASH
    assert fc.holds(OLD)
    assert fc.info().flags == InfoFlag(0)
    fc.push(NEW)
    assert fc.holds(NEW)


@pytest.mark.parametrize("act", STAGES)
def test_a_power_cut_leaves_the_old_list(fc: Companion, act: Callable[[Companion], ReplyStatus]) -> None:
    STAGES[act](fc)
    fc.device.cut_power_at(1)
    with pytest.raises(PowerCut):
        act(fc)
    fc.device.power_cycle()
    assert fc.holds(OLD)
    fc.push(NEW)
    assert fc.holds(NEW)


# -- the same conversation with both -----------------------------------------------------------------------------

LISTS = [mission(count, seed) for count in (0, 1, 3, 15, 16, CAPACITY) for seed in (3, 5)]
lists = st.sampled_from(LISTS)
#: Binary fractions of a second, so that the model's float clock hits the timeouts exactly.
times = st.sampled_from([125, 1000, 2500, 5000, 5125])


class SameAnswers(RuleBasedStateMachine):
    """All devices get the same requests and must give the same replies; the core must obey the flash's rules."""

    def __init__(self) -> None:
        super().__init__()
        self.core = CCore()
        self.devices: tuple[Device, ...] = (self.core, model(), simulated_core())
        self.records = LISTS[0]
        self.next = 0

    def ask(self, command: int, payload: bytes) -> bytes | None:
        replies = [self._ask_one(device, command, payload) for device in self.devices]
        assert len(set(replies)) == 1, (MissionCommand(command).name, payload.hex(), replies)
        if replies[0] is None:
            self.reset()
        return replies[0]

    def _ask_one(self, device: Device, command: int, payload: bytes) -> bytes | None:
        try:
            return known(device.request(command, payload))
        except PowerCut:
            return None

    def send(self, frame: bytes) -> bytes | None:
        return self.ask(frame[4], frame[5:-1])

    @rule(records=lists)
    def begin(self, records: tuple[WpRecord, ...]) -> None:
        self.records = records
        self._follow(self.send(ext.encode_begin(identify(records))))

    @rule(count=st.integers(0, 200), checksum=st.integers(0, 2**32 - 1))
    def begin_anything(self, count: int, checksum: int) -> None:
        self._follow(self.send(ext.encode_begin(ListIdentity(count, checksum))))

    @rule(count=st.integers(1, CHUNK))
    def next_chunk(self, count: int) -> None:
        self._send_chunk(self.next, count)

    @rule(records=lists)
    def all_chunks(self, records: tuple[WpRecord, ...]) -> None:
        self.begin(records)
        for first in range(self.next, len(self.records), CHUNK):
            self._send_chunk(first, CHUNK)

    @rule(offset=st.integers(-20, 20), count=st.integers(1, CHUNK))
    def some_chunk(self, offset: int, count: int) -> None:
        self._send_chunk(max(self.next + offset, 0), count)

    @rule(records=st.binary(min_size=16, max_size=16))
    def wild_chunk(self, records: bytes) -> None:
        self._follow(self.send(chunk_frame(self.next, records)))

    def _send_chunk(self, first: int, count: int) -> None:
        # Beyond the list's end come records that were not announced.
        records = (self.records + LISTS[-1])[first : first + count]
        if records:
            self._follow(self.send(chunk_frame(first, pack_records(records))))

    def _follow(self, reply: bytes | None) -> None:
        progress = ext.decode_progress(reply) if reply else None
        self.next = progress.next if progress else 0

    @rule()
    def commit(self) -> None:
        self.send(ext.encode_commit(identify(self.records)))

    @rule(records=lists)
    def commit_another(self, records: tuple[WpRecord, ...]) -> None:
        self.send(ext.encode_commit(identify(records)))

    @rule()
    def abort(self) -> None:
        self.send(ext.ABORT_REQUEST)

    @rule(first=st.integers(0, 150), count=st.integers(0, 8))
    def read(self, first: int, count: int) -> None:
        self.send(ext.encode_read(first, count))

    @rule(centimetres=st.integers(0, 2200))
    def set_radius(self, centimetres: int) -> None:
        self.send(encode_radius(centimetres))

    @rule(command=st.sampled_from(MissionCommand), payload=st.binary(max_size=243))
    def anything(self, command: MissionCommand, payload: bytes) -> None:
        self.ask(command, payload)

    @rule(milliseconds=times)
    def wait(self, milliseconds: int) -> None:
        for device in self.devices:
            device.advance(milliseconds)

    @rule(armed=st.booleans())
    def arm(self, armed: bool) -> None:
        for device in self.devices:
            device.arm(armed)

    @rule(busy=st.booleans())
    def set_busy(self, busy: bool) -> None:
        for device in self.devices:
            device.set_busy(busy)

    @rule()
    def reset(self) -> None:
        for device in self.devices:
            device.power_cycle()

    @rule(failing=st.booleans())
    def spoil_the_next_flash_operation(self, failing: bool) -> None:
        for device in self.devices:
            device.fail_at(int(failing))
            device.cut_power_at(int(not failing))

    @invariant()
    def same_state(self) -> None:
        self.send(ext.INFO_REQUEST)
        assert len({device.list for device in self.devices}) == 1
        assert self.core.is_intact


TestSameAnswers = SameAnswers.TestCase
TestSameAnswers.settings = settings(stateful_step_count=60)
