# SPDX-License-Identifier: GPL-3.0-or-later
"""MSP frames are found in any stream: byte by byte, after false or truncated headers, in bounded time."""

from functools import reduce
from itertools import pairwise
from operator import xor

from hypothesis import example, given
from hypothesis import strategies as st

from protocols.msp.frame import Direction, MspFrame, MspParser, request

commands = st.one_of(st.integers(0, 255), st.integers(256, 65535))
frames = st.builds(MspFrame, st.sampled_from(Direction), commands, st.binary(max_size=40))
encoded = frames.map(MspFrame.encode)
pieces = st.one_of(
    encoded,
    encoded.flatmap(lambda frame: st.integers(1, len(frame) - 1).map(lambda size: frame[:size])),
    encoded.flatmap(lambda frame: st.integers(1, len(frame) - 1).map(lambda start: frame[start:])),
    st.sampled_from(
        [b"$", b"$M", b"$M>", b"$M>\xff", b"$M!\x00", b"$$M", b"$X", b"$X>\x00\x00\x20\xff\x00", b"$M$", b"$M>\x03d"]
    ),
    st.binary(max_size=30),
)
streams = st.lists(pieces, max_size=12).map(b"".join)


def parse(data: bytes, cuts: list[int]) -> tuple[list[MspFrame], MspParser]:
    parser = MspParser()
    found: list[MspFrame] = []
    places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    for start, end in pairwise(places):
        found += parser.feed(data[start:end])
    return found, parser


@given(streams, st.lists(st.integers(0, 5000), max_size=8))
@example(b"$M>\xff" + request(100), [])
@example(b"$", [])
def test_a_stream_gives_the_same_frames_however_it_is_split(data: bytes, cuts: list[int]) -> None:
    whole, parser = parse(data, [])
    rest = parser.reset()
    for places in (cuts, list(range(len(data)))):
        found, other = parse(data, places)
        assert found == whole
        assert other.reset() == rest
    assert parser.skipped_bytes + sum(len(frame.encode()) for frame in whole + rest) == len(data)


@given(frames)
def test_a_frame_survives_encoding_and_parsing(frame: MspFrame) -> None:
    assert MspParser().feed(frame.encode()) == [frame]


def test_a_v2_frame_has_inavs_bytes() -> None:
    """A request for MSP2_INAV_STATUS, and INAV 9.1's reply with nav_wp_multi_mission_index."""
    assert request(0x2000) == bytes.fromhex("24583c000020000032")
    assert MspParser().feed(bytes.fromhex("24583e000310010001f7")) == [MspFrame(Direction.REPLY, 0x1003, b"\x01")]


@given(frames, st.sampled_from([254, 255, 256, 1000, 4112]))
def test_a_long_reply_is_found_between_others(frame: MspFrame, size: int) -> None:
    for command in (116, 0x2020):
        long = MspFrame(Direction.REPLY, command, bytes(range(251)) * 17, is_v2=False)
        long.payload = long.payload[:size]
        assert MspParser().feed(frame.encode() + long.encode() + frame.encode()) == [frame, long, frame]
    assert MspFrame(Direction.REPLY, 116, bytes(255)).encode()[:7] == b"$M>\xff\x74\xff\0"  # as in INAV's msp_serial.c


def test_a_request_of_255_bytes_is_not_a_jumbo_frame() -> None:
    chunk = MspFrame(Direction.REQUEST, 192, bytes(255))
    assert len(chunk.encode()) == 6 + 255
    assert MspParser().feed(chunk.encode()) == [chunk]


@given(frames, st.data())
def test_any_flipped_bit_under_the_checksum_is_detected(frame: MspFrame, data: st.DataObject) -> None:
    damaged = bytearray(frame.encode())
    at = data.draw(st.integers(3, len(damaged) - 1))
    damaged[at] ^= 1 << data.draw(st.integers(0, 7))
    assert frame not in MspParser().feed(bytes(damaged))


def test_a_reply_after_a_false_header_is_found_at_a_reset_or_more_bytes() -> None:
    answer = MspFrame(Direction.REPLY, 100, bytes(7))
    parser = MspParser()
    assert parser.feed(b"$M>\xf0\x01" + answer.encode()) == []
    assert parser.reset() == [answer]
    assert parser.feed(b"$M>\x40\x01" + answer.encode()) == []
    assert answer in parser.feed(bytes(64))


def test_a_jumbo_frame_has_at_least_255_bytes() -> None:
    """A shorter one is noise, although its checksum is right."""
    body = b"\xff\x64\x03\x00abc"
    parser = MspParser()
    assert parser.feed(b"$M>" + body + bytes((reduce(xor, body),))) + parser.reset() == []
