# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink frames are found in any stream: byte by byte, after false or truncated headers, in bounded time."""

from itertools import pairwise

from hypothesis import example, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from tests.support.packing import pack


def make_frames() -> list[bytes]:
    """Frames of both versions, short and long, truncated zeros included."""
    writer = FrameWriter(1, 190)
    some = [
        mavlink.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3),
        mavlink.MAVLink_mission_request_message(255, 190, 7, 0),
        mavlink.MAVLink_statustext_message(3, b"\xfe\xfd\xfe\x09" * 12),
        mavlink.MAVLink_mission_item_int_message(
            1, 1, 3, 3, 16, 0, 1, 0.0, 2.0, 0.0, 0.0, 453838000, 84733000, 20.0, 0
        ),
        mavlink.MAVLink_param_request_list_message(0, 0),
    ]
    return [writer.frame(pack(message), version) for message in some for version in (1, 2)]


FRAMES = make_frames()
#: Bytes that look like frame starts, and others.
pieces = st.one_of(
    st.sampled_from(FRAMES),
    st.sampled_from(FRAMES).flatmap(lambda frame: st.integers(1, len(frame) - 1).map(lambda size: frame[:size])),
    st.sampled_from(FRAMES).flatmap(lambda frame: st.integers(1, len(frame) - 1).map(lambda start: frame[start:])),
    st.sampled_from(
        [b"\xfe", b"\xfd", b"\xfe\x00", b"\xfe\xff", b"\xfd\xff\x00", b"\xfd\x00\x01", b"\xfd\x10\x00\x00"]
    ),
    st.binary(max_size=40),
)
streams = st.lists(pieces, max_size=12).map(b"".join)


def split(data: bytes, cuts: list[int]) -> tuple[list[MavlinkFrame], MavlinkSplitter]:
    splitter = MavlinkSplitter()
    frames: list[MavlinkFrame] = []
    places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    for start, end in pairwise(places):
        frames += splitter.feed(data[start:end])
    return frames, splitter


@given(streams, st.lists(st.integers(0, 5000), max_size=8))
@example(b"\xfe\xff" + FRAMES[0], [])
def test_a_stream_gives_the_same_frames_however_it_is_split(data: bytes, cuts: list[int]) -> None:
    whole, splitter = split(data, [])
    rest = splitter.feed(b"", is_end=True)
    for places in (cuts, list(range(len(data)))):
        frames, other = split(data, places)
        assert frames == whole
        assert other.feed(b"", is_end=True) == rest
    # Every byte is either in a frame or counted.
    assert splitter.skipped_bytes + sum(len(frame.raw) for frame in whole + rest) == len(data)


def test_a_signed_frame_includes_the_signature() -> None:
    codec = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    codec.signing.secret_key = bytes(32)
    codec.signing.sign_outgoing = True
    frame = bytes(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(codec))
    splitter = MavlinkSplitter()
    (found,) = splitter.feed(frame + FRAMES[0])[:1]
    assert found.raw == frame
    assert splitter.skipped_bytes == 0
