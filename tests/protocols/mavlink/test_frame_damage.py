# SPDX-License-Identifier: GPL-3.0-or-later
"""Damage in a stream of frames: exactly the intact frames are found."""

from collections import Counter
from collections.abc import Sequence
from random import Random

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink_2

from protocols.mavlink.dialect import MESSAGE_FORMATS, Message
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from tests.support.damage import Damage, damaged_stream

SIGNED = "MAVLink 2, signed"
SENDERS = ("MAVLink 1", "MAVLink 2", SIGNED)
SIGNATURE_SIZE = 13
#: Payload values that look like the beginning of a frame.
TEXT = b"\xfe\x09\xfd\x1c\x00\x00" * 8


def telemetry(sender: str, count: int, seed: int) -> list[bytes]:
    """An autopilot's frames, packed by pymavlink, all different."""
    chance = Random(seed)
    mavlink = mavlink_2.MAVLink(None, srcSystem=1, srcComponent=1)
    mavlink.signing.secret_key = bytes(range(32))
    mavlink.signing.sign_outgoing = sender == SIGNED
    frames = []
    for number in range(count):
        mavlink.seq = number % 256
        frames.append(bytes(some_message(number, chance).pack(mavlink, force_mavlink1=sender == "MAVLink 1")))
    return frames


def some_message(number: int, chance: Random) -> Message:
    axes = [chance.randint(-32768, 32767) for _ in range(9)]
    match number % 5:
        case 0:
            return mavlink_2.MAVLink_heartbeat_message(2, 3, 81, number, 3, 3)
        case 1:
            return mavlink_2.MAVLink_raw_imu_message(number, *axes)
        case 2:
            return mavlink_2.MAVLink_attitude_message(number, *map(float, axes[:6]))
        case 3:
            return mavlink_2.MAVLink_statustext_message(number % 8, TEXT[number % 7 :])
        case _:
            return mavlink_2.MAVLink_command_ack_message(number % 65536, 0, 0, 0, 255, 190)


def split(pieces: Sequence[bytes], chance: Random) -> list[bytes]:
    """Feed the bytes in reads of random size, then silence."""
    data = b"".join(pieces)
    splitter = MavlinkSplitter()
    found: list[MavlinkFrame] = []
    at = 0
    while at < len(data):
        size = chance.choice((1, 7, 64, 500))
        found += splitter.feed(data[at : at + size])
        at += size
    return [frame.raw for frame in found + splitter.feed(b"", is_end=True)]


def without_signature(frame: bytes) -> bytes:
    """For comparison: damage in a signature cannot be detected without the key."""
    return frame[:-SIGNATURE_SIZE] if frame[0] == 0xFD and frame[2] & 1 else frame


@pytest.mark.parametrize("damage", Damage)
@pytest.mark.parametrize("sender", SENDERS)
def test_exactly_the_intact_frames_are_found(sender: str, damage: Damage) -> None:
    """Fixed seeds, because each false header has a chance of 1 in 65536 to pass."""
    lost = false = 0
    for seed in range(4):
        frames = telemetry(sender, 1500, seed)
        stream = damaged_stream(frames, damage, 0.05, Random(seed))
        assert stream.pieces != frames
        found = split(stream.pieces, Random(seed))
        lost += (Counter(stream.intact) - Counter(found)).total()
        false += len(set(map(without_signature, found)) - set(map(without_signature, frames)))
    assert lost == 0
    assert false == 0


@pytest.mark.parametrize("damage", Damage)
def test_everything_pymavlink_finds_is_found(damage: Damage) -> None:
    stream = damaged_stream(telemetry("MAVLink 2", 1500, 5), damage, 0.05, Random(5))
    parser = mavlink_2.MAVLink(None)
    parser.robust_parsing = True
    messages = parser.parse_buffer(b"".join(stream.pieces))
    checked = [one for one in messages if not one.get_type().startswith(("BAD_DATA", "UNKNOWN"))]
    theirs = Counter(bytes(one.get_msgbuf()) for one in checked)
    ours = Counter(split(stream.pieces, Random(5)))
    assert theirs - ours == Counter()
    assert ours.total() >= theirs.total() > 0


@given(st.data())
def test_damage_loses_a_frame_only_to_a_false_frame(data: st.DataObject) -> None:
    chance = data.draw(st.randoms(use_true_random=False))
    pieces: list[bytes] = []
    frames: list[bytes] = []
    intact: list[bytes] = []
    for sender in SENDERS:
        sent = telemetry(sender, data.draw(st.integers(0, 10)), 1)
        stream = damaged_stream(sent, data.draw(st.sampled_from(Damage)), 0.5, chance)
        pieces += stream.pieces
        frames += sent
        intact += stream.intact
    found = split(pieces, chance)
    false = set(map(without_signature, found)) - set(map(without_signature, frames))
    assert false or not Counter(intact) - Counter(found)


FRAME = telemetry("MAVLink 2", 2, 0)[1]


@pytest.mark.parametrize(
    "header",
    [
        bytes((0xFD, 255, 0, 0, 1, 1, 1, 0xFF, 0xFF, 0xFF)),  # an unknown message
        bytes((0xFD, 255, 2, 0, 1, 1, 1, 0, 0, 0)),  # an unknown incompatibility flag
        bytes((0xFE, 255, 1, 1, 1, 0)),  # too long for a MAVLink 1 HEARTBEAT
        bytes((0xFE, 255, 1, 1, 1, 3)),
    ],
)
def test_an_impossible_header_does_not_delay_frames(header: bytes) -> None:
    assert [frame.raw for frame in MavlinkSplitter().feed(header + FRAME)] == [FRAME]


@pytest.mark.parametrize("sender", SENDERS)
def test_a_truncated_frame_delays_only_as_many_bytes_as_it_lost(sender: str) -> None:
    first, *others = telemetry(sender, 60, 3)
    for kept in range(1, len(first)):
        splitter = MavlinkSplitter()
        stream = b"".join(others)
        ends = len(others[0])
        splitter.feed(first[:kept])
        came_at = next(count for count, byte in enumerate(stream, 1) if splitter.feed(bytes((byte,))))
        assert came_at <= max(ends, len(first) - kept + SIGNATURE_SIZE)


def test_silence_releases_a_frame_hidden_by_a_truncated_frame() -> None:
    splitter = MavlinkSplitter()
    hiding = bytes((0xFD, 255, 0, 0, 1, 1, 1, 0, 0, 0))
    assert splitter.feed(hiding + FRAME + FRAME) == []
    assert [frame.raw for frame in splitter.feed(b"", is_end=True)] == [FRAME, FRAME]
    assert splitter.skipped_bytes == len(hiding)
    assert splitter.feed(b"", is_end=True) == []


def test_a_signature_with_missing_bytes_does_not_lose_a_later_frame() -> None:
    """The loss cannot be detected without the key."""
    before, cut, after = telemetry(SIGNED, 3, 4)
    for missing in range(1, SIGNATURE_SIZE + 1):
        found = split([before, cut[:-missing], after], Random(missing))
        assert found[0] == before
        assert found[-1] == after
        assert [without_signature(frame) for frame in found[1:-1]] == [without_signature(cut)]


@pytest.mark.parametrize("size", [0, 1, 255])
def test_a_mavlink_2_payload_may_be_truncated_or_extended(size: int) -> None:
    """Trailing zeros are omitted, and later definitions add fields: a HEARTBEAT has 9 bytes today."""
    body = bytes((size, 0, 0, 0, 1, 1, 0, 0, 0)) + bytes(range(1, size + 1))
    raw = b"\xfd" + body + mcrf4xx(body + bytes((MESSAGE_FORMATS[0].crc_extra,))).to_bytes(2, "little")
    (frame,) = MavlinkSplitter().feed(raw)
    assert frame.raw == raw
    assert frame.payload == body[9:]
