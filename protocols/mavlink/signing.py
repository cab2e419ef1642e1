# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink 2 message signing (https://mavlink.io/en/guide/message_signing.html).

A signed frame ends in 13 bytes: a link id, a timestamp of 48 bits in 10 us since 2015-01-01, and the first 6 bytes of
the SHA-256 of key, frame, link id and timestamp. It authenticates the sender and prevents replays; nothing is
encrypted.
"""

from collections.abc import Callable
from enum import Enum
from hashlib import sha256
from hmac import compare_digest

from protocols.mavlink.frame import MavlinkFrame

TICKS_PER_S = 100_000
#: 2015-01-01 in seconds since the Unix epoch.
EPOCH_UNIX_S = 1_420_070_400
#: The maximum lag of a new stream behind our timestamp.
TOLERANCE = 60 * TICKS_PER_S
_MAX_TIMESTAMP = (1 << 48) - 1
_TIMESTAMP_SIZE = 6
_DIGEST_SIZE = 6
_SIGNATURE_SIZE = 1 + _TIMESTAMP_SIZE + _DIGEST_SIZE

#: A stream of timestamps: sysid, compid, link id.
Stream = tuple[int, int, int]


def key_from_passphrase(passphrase: str) -> bytes:
    """The 32-byte key that Mission Planner and MAVProxy derive from a passphrase."""
    return sha256(passphrase.encode()).digest()


def ticks(unix_s: float) -> int:
    """The signing timestamp of a Unix time in seconds; 0 before 2015."""
    return max(0, int((unix_s - EPOCH_UNIX_S) * TICKS_PER_S))


class Timestamps:
    """The timestamps of outgoing frames: the time, but strictly increasing even if the clock steps back.

    `clock` returns seconds since the Unix epoch. `at_least`: the last one of an earlier run.
    """

    def __init__(self, clock: Callable[[], float], at_least: int = 0) -> None:
        self._clock = clock
        self.last = min(at_least, _MAX_TIMESTAMP)

    def now(self) -> int:
        """The current timestamp, without consuming it."""
        return max(self.last, ticks(self._clock()))

    def take(self) -> int:
        """The timestamp for the next frame."""
        self.last = min(max(self.last + 1, ticks(self._clock())), _MAX_TIMESTAMP)
        return self.last

    def follow(self, timestamp: int) -> None:
        """Adopt the timestamp of a peer with the key whose clock is ahead of ours."""
        self.last = max(self.last, timestamp)


class Check(Enum):
    """The validity of a frame's signature. The value is the text for the pilot."""

    VALID = "signed"
    UNSIGNED = "not signed"
    WRONG = "signed with another key"
    REPLAYED = "its timestamp was used before"
    LATE = "signed over a minute behind our clock"
    UNSURE = "signed too soon after a power cut: wait 10 s"


class Signing:
    """One key and the timestamps used with it. Links with the same key share one instance.

    `refused_until`: frames up to this timestamp are refused, because an earlier run may have accepted them unrecorded.
    """

    def __init__(self, key: bytes, timestamps: Timestamps, refused_until: int = -1) -> None:
        self._key = key
        self._timestamps = timestamps
        self._refused_until = refused_until
        self._heard: set[Stream] = set()
        #: The last timestamp of each stream, ours included. Those of an earlier run may be added before any frame.
        self.streams: dict[Stream, int] = {}

    def signature(self, frame: bytes, link_id: int) -> bytes:
        """The 13 signature bytes of a MAVLink 2 frame whose flags mark it as signed."""
        timestamp = self._timestamps.take()
        # Sent back by a stranger, the frame must not prove the key.
        self.streams[frame[5], frame[6], link_id] = timestamp
        stamp = bytes((link_id,)) + timestamp.to_bytes(_TIMESTAMP_SIZE, "little")
        return stamp + self._digest(frame + stamp)

    def check(self, frame: MavlinkFrame) -> Check:
        """Check a signature. Each is valid only once."""
        if not frame.is_signed:
            return Check.UNSIGNED
        raw = frame.raw
        if not compare_digest(self._digest(raw[:-_DIGEST_SIZE]), raw[-_DIGEST_SIZE:]):
            return Check.WRONG
        stream = frame.sysid, frame.compid, raw[-_SIGNATURE_SIZE]
        timestamp = int.from_bytes(raw[-_SIGNATURE_SIZE + 1 : -_DIGEST_SIZE], "little")
        if timestamp <= self.streams.get(stream, -1):
            return Check.REPLAYED
        if timestamp <= self._refused_until:
            return Check.UNSURE
        # Both rules apply to a stream of an earlier run: it may have been recorded while the bridge was off.
        if stream not in self._heard and timestamp + TOLERANCE < self._timestamps.now():
            return Check.LATE
        self._heard.add(stream)
        self.streams[stream] = timestamp
        self._timestamps.follow(timestamp)
        return Check.VALID

    def _digest(self, signed: bytes) -> bytes:
        return sha256(self._key + signed).digest()[:_DIGEST_SIZE]
