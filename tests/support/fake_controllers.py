# SPDX-License-Identifier: GPL-3.0-or-later
"""Devices other than a Harakiri on the line, as a `peer` of the world."""

import itertools
import random
import struct
from collections.abc import Mapping
from math import inf

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.msp.frame import Direction, MspFrame, MspParser

HARAKIRI_CAPABILITY = 0x80000000


def ident(version: int, capability: int) -> bytes:
    return struct.pack("<BBBI", version, 3, 0, capability)


class QuietLine:
    """A silent line. The other fakes extend it: bytes put into `outgoing` arrive at once."""

    def __init__(self, baud: int = 115200) -> None:
        self.baud = baud
        self.stored = b""
        self.outgoing = bytearray()

    def power_on_booted(self, now: float) -> None:
        """Nothing to switch on."""

    def receive(self, data: bytes, now: float) -> None:
        """Receive bytes from the bridge."""

    def advance(self, now: float) -> bytes:
        """Return the bytes for the bridge."""
        data = bytes(self.outgoing)
        self.outgoing.clear()
        return data

    def next_wakeup(self, now: float) -> float:
        return now if self.outgoing else inf


class Loopback(QuietLine):
    """The port's own TX wired to its RX."""

    def receive(self, data: bytes, now: float) -> None:
        self.outgoing += data


class MspFake(QuietLine):
    """Answers MSP from a table; other requests get an error, or no reply if `silent_on_unknown`."""

    def __init__(self, answers: Mapping[int, bytes], *, silent_on_unknown: bool = False) -> None:
        super().__init__()
        self.answers = answers
        self.asked: list[int] = []
        self._silent = silent_on_unknown
        self._parser = MspParser()

    def receive(self, data: bytes, now: float) -> None:
        for frame in self._parser.feed(data):
            self.asked.append(frame.command)
            payload = self.answers.get(frame.command)
            if payload is not None:
                self.outgoing += MspFrame(Direction.REPLY, frame.command, payload).encode()
            elif not self._silent:
                self.outgoing += MspFrame(Direction.ERROR, frame.command).encode()


class MavlinkOnly(QuietLine):
    """A flight controller that sends only a heartbeat a second."""

    def __init__(self, version: int = 2, sysid: int = 1) -> None:
        super().__init__()
        self._mavlink = messages.MAVLink(None, srcSystem=sysid, srcComponent=1)
        self._version = version
        self._due = 0.3

    def advance(self, now: float) -> bytes:
        while self._due <= now:
            self._due += 1.0
            message = messages.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3)
            self.outgoing += bytes(message.pack(self._mavlink, force_mavlink1=self._version == 1))
            # The gaps are other messages, which are not received.
            self._mavlink.seq = (self._mavlink.seq + 7) % 256
        return super().advance(now)

    def next_wakeup(self, now: float) -> float:
        return min(super().next_wakeup(now), self._due)


class Noise(QuietLine):
    """Endless random bytes, drawn from `alphabet`."""

    def __init__(self, seed: int, alphabet: bytes = bytes(range(256)), chunk: int = 512) -> None:
        super().__init__()
        # One long pool, read at random positions, so that noise costs less CPU than the code under test.
        self._random = random.Random(seed)
        self._pool = bytes(self._random.choices(alphabet, k=1 << 18))
        self._chunk = chunk
        self._due = itertools.count()
        self._at = 0.0
        self.sent = 0

    def advance(self, now: float) -> bytes:
        if now < self._at:
            return b""
        self._at = now + self._chunk * 10 / self.baud
        start = self._random.randrange(len(self._pool) - self._chunk)
        self.sent += self._chunk
        return self._pool[start : start + self._chunk]

    def next_wakeup(self, now: float) -> float:
        return max(now, self._at)
