# SPDX-License-Identifier: GPL-3.0-or-later
"""Signing compared with pymavlink's, both ways, and the rules for timestamps."""

from datetime import UTC, datetime
from hashlib import sha256

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mavlink.signing import Check, SignedPeer, Signing, Timestamps, key_from_passphrase, ticks
from tests.support.packing import pack

#: MAVLink's signing: ticks of 10 us, and the greatest lag of a new stream, one minute.
TICKS_PER_S, TOLERANCE = 100_000, 6_000_000


KEY = key_from_passphrase("a passphrase")
#: A moment in 2026, in seconds since the Unix epoch.
NOON = 1_795_262_400.0
DAY = 86400 * TICKS_PER_S
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def pymavlink_side(key: bytes = KEY, timestamp: int = ticks(NOON), link_id: int = 7) -> mavlink.MAVLink:
    side = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    side.robust_parsing = False
    side.signing.secret_key = key
    side.signing.sign_outgoing = True
    side.signing.link_id = link_id
    side.signing.timestamp = timestamp
    return side


def our_side(unix_s: float = NOON, at_least: int = 0) -> Signing:
    return Signing(KEY, Timestamps(lambda: unix_s, at_least))


def frame_of(side: mavlink.MAVLink, message: mavlink.MAVLink_message = HEARTBEAT) -> MavlinkFrame:
    return MavlinkFrame(bytes(message.pack(side)))


@pytest.fixture
def signing() -> Signing:
    return our_side()


def test_the_key_is_derived_like_mission_planners() -> None:
    assert key_from_passphrase("grüezi") == sha256("grüezi".encode()).digest()


def test_timestamps_count_10_us_since_2015() -> None:
    assert ticks(datetime(2015, 1, 1, tzinfo=UTC).timestamp()) == 0
    assert ticks(datetime(2015, 1, 1, 0, 1, tzinfo=UTC).timestamp()) == 60 * TICKS_PER_S
    # A Pi without a clock starts in 1970.
    assert ticks(0.0) == 0


@pytest.mark.parametrize("link_id", [0, 3, 255])
def test_pymavlink_accepts_our_signatures(link_id: int, signing: Signing) -> None:
    writer = FrameWriter(1, 1, SignedPeer(signing, link_id, "gcs").sign)
    receiver = pymavlink_side()
    for count in range(300):
        sent = mavlink.MAVLink_statustext_message(6, b"x" * (count % 50))
        (message,) = receiver.parse_buffer(writer.frame(pack(sent), 2))
        assert message.text == "x" * (count % 50)
        assert message.get_signed()
        assert message.get_link_id() == link_id
    assert receiver.signing.badsig_count == 0
    stranger = pymavlink_side(sha256(b"another").digest())
    with pytest.raises(mavlink.MAVError):
        stranger.parse_buffer(writer.frame(pack(HEARTBEAT), 2))


def test_a_mavlink_1_frame_is_never_signed(signing: Signing) -> None:
    signed = FrameWriter(1, 1, SignedPeer(signing, 0, "gcs").sign)
    assert signed.frame(pack(HEARTBEAT), 1) == FrameWriter(1, 1).frame(pack(HEARTBEAT), 1)


def test_we_accept_pymavlinks_signatures(signing: Signing) -> None:
    side = pymavlink_side()
    data = b"".join(frame_of(side, mavlink.MAVLink_ping_message(n, n, 1, 1)).raw for n in range(300))
    frames = MavlinkSplitter().feed(data)
    assert len(frames) == 300
    assert {signing.check(frame) for frame in frames} == {Check.VALID}
    # None of them is accepted again.
    assert {signing.check(frame) for frame in frames} == {Check.REPLAYED}


def test_unsigned_frames_of_both_versions_are_recognised() -> None:
    side = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    for mavlink_1 in (False, True):
        assert our_side().check(MavlinkFrame(bytes(HEARTBEAT.pack(side, force_mavlink1=mavlink_1)))) is Check.UNSIGNED


def test_a_frame_with_another_key_is_refused_and_does_not_change_a_state(signing: Signing) -> None:
    far_ahead = ticks(NOON) + TOLERANCE
    assert signing.check(frame_of(pymavlink_side(sha256(b"").digest(), far_ahead))) is Check.WRONG
    # Mission Planner signs with 32 zero bytes before it has a key.
    assert signing.check(frame_of(pymavlink_side(bytes(32), far_ahead))) is Check.WRONG
    assert signing.check(frame_of(pymavlink_side())) is Check.VALID


@given(at=st.integers(1, 21 + 12), bit=st.integers(0, 7))
def test_any_flipped_bit_is_detected(at: int, bit: int) -> None:
    raw = bytearray(frame_of(pymavlink_side()).raw)
    assert len(raw) == 21 + 13
    raw[at] ^= 1 << bit
    assert our_side().check(MavlinkFrame(bytes(raw))) is not Check.VALID


def test_each_stream_has_its_own_timestamps(signing: Signing) -> None:
    for link_id in (1, 2):
        for timestamp in (ticks(NOON), ticks(NOON) + 1, ticks(NOON) + 3):
            assert signing.check(frame_of(pymavlink_side(timestamp=timestamp, link_id=link_id))) is Check.VALID
        for timestamp in (ticks(NOON) + 3, ticks(NOON) + 2, ticks(NOON)):
            assert signing.check(frame_of(pymavlink_side(timestamp=timestamp, link_id=link_id))) is Check.REPLAYED


@pytest.mark.parametrize(
    ("lag", "expected"), [(0, Check.VALID), (TOLERANCE, Check.VALID), (TOLERANCE + 1, Check.LATE), (-DAY, Check.VALID)]
)
def test_a_new_stream_is_at_most_a_minute_behind_us(lag: int, expected: Check) -> None:
    assert our_side().check(frame_of(pymavlink_side(timestamp=ticks(NOON) - lag))) is expected


def test_a_known_stream_may_fall_behind_others(signing: Signing) -> None:
    slow = pymavlink_side(timestamp=ticks(NOON) - 100, link_id=1)
    assert signing.check(frame_of(slow)) is Check.VALID
    assert signing.check(frame_of(pymavlink_side(timestamp=ticks(NOON) + 10 * TOLERANCE, link_id=2))) is Check.VALID
    assert signing.check(frame_of(slow)) is Check.VALID


def test_our_timestamps_never_repeat() -> None:
    clock = [NOON, NOON, NOON - 3600, 0.0, NOON + 1, NOON + 1]
    timestamps = Timestamps(lambda: clock.pop(0))
    start = ticks(NOON)
    taken = [timestamps.take() for _ in range(6)]
    assert taken == [start, start + 1, start + 2, start + 3, start + TICKS_PER_S, start + TICKS_PER_S + 1]


def signed_at(signing: Signing, timestamp: int, host: str, link_id: int = 0) -> Check:
    return signing.check(frame_of(pymavlink_side(timestamp=timestamp, link_id=link_id)), host)


def sent_at(peer: SignedPeer) -> int:
    return int.from_bytes(peer.sign(bytes(10))[1:7], "little")


def test_before_the_clock_is_set_a_peer_may_be_ahead() -> None:
    is_set = False
    timestamps = Timestamps(lambda: NOON, is_clock_set=lambda: is_set)
    signing = Signing(KEY, timestamps)
    month_ahead = ticks(NOON) + 30 * DAY
    assert signed_at(signing, month_ahead, "pilot") is Check.VALID
    assert signed_at(signing, (1 << 48) - 1, "wrong clock", 1) is Check.VALID
    assert signed_at(signing, ticks(NOON), "another", 2) is Check.VALID
    assert timestamps.now() == ticks(NOON)
    is_set = True
    assert signed_at(signing, month_ahead + 1, "pilot") is Check.EARLY


def test_without_a_clock_timestamps_continue() -> None:
    stored = ticks(NOON)
    signing = our_side(unix_s=0.0, at_least=stored)
    assert signed_at(signing, stored - TOLERANCE - 1, "late") is Check.LATE
    assert sent_at(SignedPeer(signing, 0, "gcs")) == stored + 1


@pytest.mark.parametrize("timestamp", [ticks(NOON) + DAY + 1, (1 << 48) - 1])
def test_a_time_over_a_day_ahead_of_every_clock_is_refused(timestamp: int, signing: Signing) -> None:
    assert signed_at(signing, timestamp, "wrong clock") is Check.EARLY
    assert signed_at(signing, ticks(NOON), "right clock") is Check.VALID
    # The clocks of stations count.
    assert signed_at(signing, ticks(NOON) + DAY, "another", 1) is Check.VALID
    assert signed_at(signing, ticks(NOON) + 2 * DAY, "another", 1) is Check.VALID


def test_our_time_follows_two_hosts_that_agree_but_not_a_single_host(signing: Signing) -> None:
    later = ticks(NOON) + 3600 * TICKS_PER_S
    for link_id in range(3):  # several programs of one laptop
        assert signed_at(signing, later, "one", link_id) is Check.VALID
    assert sent_at(SignedPeer(signing, 9, "gcs")) < ticks(NOON) + TICKS_PER_S
    assert signed_at(signing, ticks(NOON), "right clock", 3) is Check.VALID
    assert signed_at(signing, later + TOLERANCE, "two", 4) is Check.VALID
    assert later < sent_at(SignedPeer(signing, 9, "gcs")) < later + TICKS_PER_S
    assert signed_at(signing, ticks(NOON), "late", 5) is Check.LATE


@pytest.mark.parametrize("lead", [3600 * TICKS_PER_S, 2 * DAY])
def test_frames_to_a_peer_use_the_peers_time(lead: int, signing: Signing) -> None:
    """Even if its frames are refused: it would not accept the reason otherwise."""
    ahead, other = SignedPeer(signing, 0, "ahead"), SignedPeer(signing, 0, "other")
    ahead.check(frame_of(pymavlink_side(timestamp=ticks(NOON) + lead)))
    sent = [sent_at(ahead) for _ in range(3)]
    assert sent == sorted(set(sent))
    assert sent[0] > ticks(NOON) + lead
    assert sent_at(other) < ticks(NOON) + TICKS_PER_S


def test_after_a_reset_the_next_peer_is_believed() -> None:
    timestamps = Timestamps(lambda: NOON, ticks(NOON) + 50 * DAY)
    signing = Signing(KEY, timestamps)
    ours = MavlinkFrame(FrameWriter(1, 1, SignedPeer(signing, 0, "gcs").sign).frame(pack(HEARTBEAT), 2))
    assert signed_at(signing, ticks(NOON), "right clock") is Check.LATE
    timestamps.forget()
    signing.forget()
    assert signed_at(signing, ticks(NOON), "right clock") is Check.VALID
    assert signed_at(signing, ticks(NOON) + 2 * DAY, "too early", 1) is Check.EARLY
    assert signing.check(ours) is Check.REPLAYED


def test_frames_received_in_an_earlier_run_are_replays() -> None:
    before = our_side()
    frame = frame_of(pymavlink_side())
    assert before.check(frame) is Check.VALID
    after = our_side(unix_s=NOON + 5)
    after.streams.update(before.streams)
    assert after.check(frame) is Check.REPLAYED
    # A frame recorded while we were off may be at most a minute old, even from a known stream.
    much_after = our_side(unix_s=NOON + 3600)
    much_after.streams.update(before.streams)
    assert much_after.check(frame_of(pymavlink_side(timestamp=ticks(NOON) + 1))) is Check.LATE


def test_the_largest_timestamp_does_not_raise(signing: Signing) -> None:
    peer = SignedPeer(signing, 0, "gcs")
    assert peer.check(frame_of(pymavlink_side(timestamp=(1 << 48) - 1))) is Check.EARLY
    assert len(peer.sign(bytes(10))) == 13
