# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames kept and dropped for a TCP client that does not read."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as m

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkSplitter
from service.links.send_queue import SendQueue
from tests.support.packing import pack

LIMIT = 600


def chunks(kinds: Sequence[int]) -> list[bytes]:
    """Numbered telemetry (0), acks (1), and both in one datagram (2)."""
    writer = FrameWriter(1, 1)
    made = []
    for number, kind in enumerate(kinds):
        attitude = writer.frame(pack(m.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)), 2)
        ack = writer.frame(pack(m.MAVLink_mission_ack_message(255, 190, number % 15, 0)), 2)
        made.append((attitude, ack, attitude + ack)[kind])
    return made


def drain(queue: SendQueue, step: int = 1 << 20) -> bytes:
    out = b""
    while queue:
        piece = bytes(queue.first()[:step])
        out += piece
        queue.sent(len(piece))
    return out


@given(st.lists(st.integers(0, 2), max_size=60), st.integers(1, 50), st.data())
def test_frames_are_whole_and_ordered_and_important_ones_kept(kinds: list[int], step: int, data: st.DataObject) -> None:
    queue = SendQueue(LIMIT)
    out, offered = b"", []
    for chunk, kind in zip(chunks(kinds), kinds, strict=True):
        fits = queue.add(chunk)
        offered.append((chunk, kind))
        if not fits:
            assert sum(len(chunk) for chunk, kind in offered if kind) > LIMIT - len(chunk)
            return
        if data.draw(st.booleans()):
            piece = bytes(queue.first()[:step])
            out += piece
            queue.sent(len(piece))
    out += drain(queue, step)
    frames = MavlinkSplitter().feed(out)
    assert b"".join(frame.raw for frame in frames) == out
    kept = b"".join(chunk for chunk, kind in offered if kind)
    acks = [frame.raw for frame in MavlinkSplitter().feed(kept) if frame.msgid == m.MAVLINK_MSG_ID_MISSION_ACK]
    assert [frame.raw for frame in frames if frame.msgid == m.MAVLINK_MSG_ID_MISSION_ACK] == acks
    places = [b"".join(chunk for chunk, _ in offered).index(frame.raw) for frame in frames]
    assert places == sorted(places)


def test_after_a_stall_the_newest_telemetry_is_sent() -> None:
    queue = SendQueue(LIMIT)
    made = chunks([0] * 100)
    for chunk in made:
        assert queue.add(chunk)
    left = drain(queue)
    assert left.endswith(made[-1])
    assert len(left) <= LIMIT
    assert queue.dropped == 100 - left.count(b"\xfd")


def test_an_overflow_of_important_frames_is_reported() -> None:
    queue = SendQueue(LIMIT)
    assert not all(queue.add(chunk) for chunk in chunks([1] * 100))
