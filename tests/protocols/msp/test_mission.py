# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission extension's requests have no hazard bytes, and the board decodes them correctly."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from protocols.mission_item import ListIdentity, pack_records
from protocols.msp.frame import MspFrame, MspParser, apply_mask, find_mask
from protocols.msp.mission import (
    ABORT_REQUEST,
    INFO_REQUEST,
    RECORD_SIZE,
    MissionCommand,
    WpRecord,
    encode_begin,
    encode_chunk,
    encode_commit,
    encode_read,
    unpack_records,
)
from simulator.board.msp_port import MspReceiver
from simulator.naze.replies import MAX_RADIUS_CM, encode_radius, unmask

#: Three in a row of one of these act on Harakiri's command line (serial.c, serialCom).
HAZARDS = frozenset(b"\r#R")
#: Half of them hazards, the worst case for masking.
hard_bytes = st.one_of(st.sampled_from(sorted(HAZARDS)), st.integers(0, 255))
records = st.one_of(
    st.binary(min_size=RECORD_SIZE, max_size=RECORD_SIZE),
    st.lists(hard_bytes, min_size=RECORD_SIZE, max_size=RECORD_SIZE).map(bytes),
).map(lambda data: unpack_records(data)[0])
identities = st.builds(ListIdentity, st.integers(0, 65535), st.integers(0, 2**32 - 1))


def received(frame: bytes) -> tuple[int, bytes]:
    """A frame as decoded by the firmware's receiver."""
    receiver = MspReceiver(3 + 15 * RECORD_SIZE)
    requests = [request for byte in frame if (request := receiver.push(byte)) is not None]
    assert len(requests) == 1
    return requests[0]


def body_of(frame: bytes, command: MissionCommand) -> bytes:
    assert HAZARDS.isdisjoint(frame)
    assert [type(found) for found in MspParser().feed(frame)] == [MspFrame]
    requests, payload = received(frame)
    assert requests == command
    body = unmask(payload)
    assert body is not None
    return body


@given(identities)
def test_begin_and_commit_carry_the_identity(identity: ListIdentity) -> None:
    for encode, command in ((encode_begin, MissionCommand.BEGIN), (encode_commit, MissionCommand.COMMIT)):
        body = body_of(encode(identity), command)
        assert (int.from_bytes(body[:2], "little"), int.from_bytes(body[2:], "little")) == (
            identity.count,
            identity.checksum,
        )


@given(st.integers(0, 65535), st.integers(1, 255))
def test_read_carries_start_and_count(first: int, count: int) -> None:
    assert body_of(encode_read(first, count), MissionCommand.READ) == first.to_bytes(2, "little") + bytes((count, 0))


def test_every_radius_can_be_sent() -> None:
    for radius_cm in range(MAX_RADIUS_CM + 1):
        body = body_of(encode_radius(radius_cm), MissionCommand.RADIUS)
        assert int.from_bytes(body[:2], "little") == radius_cm
        assert int.from_bytes(body[2:], "little") == radius_cm ^ 0xFFFF


def test_requests_without_a_body_are_clean() -> None:
    assert HAZARDS.isdisjoint(INFO_REQUEST)
    assert HAZARDS.isdisjoint(ABORT_REQUEST)


@given(st.lists(records, min_size=1, max_size=40), st.data())
def test_any_list_can_be_sent_in_chunks(wanted: Sequence[WpRecord], data: st.DataObject) -> None:
    most = data.draw(st.integers(1, 15))
    sent: list[WpRecord] = []
    while len(sent) < len(wanted):
        chunk = encode_chunk(pack_records(wanted), len(sent), most)
        assert 1 <= chunk.count <= most
        body = body_of(chunk.frame, MissionCommand.CHUNK)
        assert int.from_bytes(body[:2], "little") == chunk.first == len(sent)
        sent += unpack_records(body[2:])
        assert len(sent) == chunk.first + chunk.count
    assert sent == list(wanted)


@given(st.lists(hard_bytes, max_size=41).map(bytes), st.integers(0, 255))
def test_a_body_of_up_to_83_bytes_always_has_a_mask(half: bytes, fixed_xor: int) -> None:
    body = half + half[::-1]
    mask = find_mask(body, fixed_xor)
    assert mask is not None
    assert apply_mask(apply_mask(body, mask), mask) == body


@given(st.binary(max_size=20))
def test_an_unmasked_body_is_refused(payload: bytes) -> None:
    body = unmask(payload)
    if len(payload) % 2 == 0:
        assert body is None
    else:
        assert body == apply_mask(payload[1:], payload[0])
