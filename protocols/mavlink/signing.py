# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink 2 message signing (https://mavlink.io/en/guide/message_signing.html).

A signed frame ends in 13 bytes: a link id, a timestamp of 48 bits in 10 us since 2015-01-01, and the first 6 bytes of
the SHA-256 of key, frame, link id and timestamp. It authenticates the sender and prevents replays, without
encryption.
"""

from collections.abc import Callable, Hashable
from enum import Enum
from hashlib import sha256
from hmac import compare_digest

from protocols.mavlink.frame import MavlinkFrame

TICKS_PER_S = 100_000
#: 2015-01-01 in seconds since the Unix epoch.
EPOCH_UNIX_S = 1_420_070_400
#: The maximum lag of a new stream behind our timestamp.
TOLERANCE = 60 * TICKS_PER_S
#: The maximum lead of a signed frame over every known clock.
MAX_LEAD = 24 * 3600 * TICKS_PER_S
_MAX_HOSTS = 64
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
    """The signing timestamp of a Unix time in seconds, or 0 before 2015."""
    return max(0, int((unix_s - EPOCH_UNIX_S) * TICKS_PER_S))


class Timestamps:
    """The timestamps of outgoing frames: the time, but strictly increasing even if the clock steps back.

    `clock` returns seconds since the Unix epoch. `at_least`: the last one of an earlier run. `newest`: the newest that
    any peer with the key had, or None if the next is believed. `is_clock_set`: False while the clock may be weeks
    behind, so that a peer's lead is not a fault of the peer.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        at_least: int = 0,
        newest: int | None = 0,
        is_clock_set: Callable[[], bool] = lambda: True,
    ) -> None:
        self._clock = clock
        self._is_clock_set = is_clock_set
        self.last = min(at_least, _MAX_TIMESTAMP)
        self.newest = newest
        self._by_host: dict[Hashable, int] = {}

    def now(self) -> int:
        """The current timestamp, without consuming it."""
        return max(self.last, ticks(self._clock()))

    def take(self) -> int:
        """The timestamp for the next frame."""
        self.last = min(max(self.last + 1, ticks(self._clock())), _MAX_TIMESTAMP)
        return self.last

    def are_all_behind(self, timestamp: int) -> bool:
        """True if a timestamp is over a day ahead of our clock, which must be set, and of those of all peers."""
        return self._is_far_ahead(timestamp) and self._is_clock_set()

    def _is_far_ahead(self, timestamp: int) -> bool:
        return self.newest is not None and timestamp > max(self.now(), self.newest) + MAX_LEAD

    def heard(self, timestamp: int, host: Hashable) -> None:
        """Note the timestamp of a peer with the key. Ours follows two hosts that agree, never a single one."""
        if not self._is_far_ahead(timestamp):
            self.newest = max(self.newest or 0, timestamp)
        self._by_host[host] = timestamp
        if len(self._by_host) > _MAX_HOSTS:
            del self._by_host[next(iter(self._by_host))]
        if timestamp > self.last:
            agreeing = [each for name, each in self._by_host.items() if name != host and each >= timestamp - TOLERANCE]
            self.last = max([self.last, *(min(each, timestamp) for each in agreeing)])

    def forget(self) -> None:
        """Start again from our clock, and believe the next peer with the key."""
        self.last, self.newest = 0, None
        self._by_host.clear()


class Check(Enum):
    """The validity of a frame's signature. The value is the text for the pilot."""

    VALID = "signed"
    UNSIGNED = "not signed"
    WRONG = "signed with another key"
    REPLAYED = "its timestamp was used before"
    LATE = "signed over a minute behind our clock"
    EARLY = "signed over a day ahead: set the clocks"
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
        self._ours: set[Stream] = set()
        #: The last timestamp of each stream, ours included. Those of an earlier run may be added before any frame.
        self.streams: dict[Stream, int] = {}

    def take(self, at_least: int) -> int:
        """The timestamp for the next frame to a peer whose own was `at_least`."""
        return min(max(self._timestamps.take(), at_least), _MAX_TIMESTAMP)

    def signature(self, frame: bytes, link_id: int, timestamp: int) -> bytes:
        """The 13 signature bytes of a MAVLink 2 frame whose flags mark it as signed."""
        # Sent back by a stranger, the frame must not prove the key.
        stream = frame[5], frame[6], link_id
        self._ours.add(stream)
        self.streams[stream] = max(timestamp, self.streams.get(stream, 0))
        stamp = bytes((link_id,)) + timestamp.to_bytes(_TIMESTAMP_SIZE, "little")
        return stamp + self._digest(frame + stamp)

    def check(self, frame: MavlinkFrame, host: Hashable = None) -> Check:
        """Check a signature from a host. Each is valid only once."""
        if not frame.is_signed:
            return Check.UNSIGNED
        raw = frame.raw
        if not compare_digest(self._digest(raw[:-_DIGEST_SIZE]), raw[-_DIGEST_SIZE:]):
            return Check.WRONG
        stream = frame.sysid, frame.compid, raw[-_SIGNATURE_SIZE]
        timestamp = timestamp_of(frame)
        if timestamp <= self.streams.get(stream, -1):
            return Check.REPLAYED
        if timestamp <= self._refused_until:
            return Check.UNSURE
        if self._timestamps.are_all_behind(timestamp):
            return Check.EARLY
        # Both rules apply to a stream of an earlier run: it may have been recorded while the bridge was off.
        if stream not in self._heard and timestamp + TOLERANCE < self._timestamps.now():
            return Check.LATE
        self._heard.add(stream)
        self.streams[stream] = timestamp
        self._timestamps.heard(timestamp, host)
        return Check.VALID

    def forget(self) -> None:
        """Forget the timestamps of all peers, but not of our own frames."""
        self._refused_until = -1
        self._heard.clear()
        self.streams = {stream: last for stream, last in self.streams.items() if stream in self._ours}

    def _digest(self, signed: bytes) -> bytes:
        return sha256(self._key + signed).digest()[:_DIGEST_SIZE]


class SignedPeer:
    """The other end of a link with a key.

    It gets frames of its own time, if that is ahead: it would refuse those that are over a minute behind the clock.
    """

    def __init__(self, signing: Signing, link_id: int, host: Hashable) -> None:
        self._signing = signing
        self._link_id = link_id
        self._host = host
        self._last = 0

    def check(self, frame: MavlinkFrame) -> Check:
        """Check a frame from it."""
        check = self._signing.check(frame, self._host)
        if check in (Check.VALID, Check.EARLY):
            self._last = max(self._last, timestamp_of(frame))
        return check

    def sign(self, frame: bytes) -> bytes:
        """The signature of a MAVLink 2 frame for it."""
        self._last = self._signing.take(self._last + 1)
        return self._signing.signature(frame, self._link_id, self._last)


def timestamp_of(frame: MavlinkFrame) -> int:
    """The timestamp of a signed frame."""
    return int.from_bytes(frame.raw[-_SIGNATURE_SIZE + 1 : -_DIGEST_SIZE], "little")
