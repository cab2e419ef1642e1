# SPDX-License-Identifier: GPL-3.0-or-later
"""A test bench: a simulated Naze, a client on its UART, and a clock moved only by the test."""

from collections.abc import Sequence

from protocols.mission_item import identify, pack_records
from protocols.msp.frame import MspFrame, MspParser
from protocols.msp.mission import (
    ReplyStatus,
    Staged,
    Stored,
    WpRecord,
    decode_progress,
    decode_records,
    decode_stored,
    encode_begin,
    encode_chunk,
    encode_commit,
    encode_read,
)
from simulator.board.far_end import FarEnd
from simulator.board.options import Faults, SimOptions
from simulator.naze.board import SimulatedNaze

BOOT_SECONDS = SimOptions().boot_ms / 1000


class WireBench:
    """A client on the UART of a given, booted board. `received` has all bytes received from it."""

    def __init__(self, board: FarEnd, now: float = 0.0) -> None:
        self._board = board
        self.now = now
        self.received = bytearray()
        self._parser = MspParser()
        self._frames: list[MspFrame] = []

    def send(self, data: bytes) -> None:
        self._board.receive(data, self.now)

    def run(self, seconds: float) -> bytes:
        """Let time pass; return the received bytes."""
        end = self.now + seconds
        before = len(self.received)
        while self.now < end:
            self.now = min(max(self._board.next_wakeup(self.now), self.now + 1e-6), end)
            self._collect()
        return bytes(self.received[before:])

    def ask(self, frame: bytes, timeout: float = 1.0) -> MspFrame | None:
        """Send a request and return the first frame received; None after `timeout` seconds."""
        self._frames.clear()
        self.send(frame)
        return self.next_frame(timeout)

    def next_frame(self, timeout: float = 1.0) -> MspFrame | None:
        end = self.now + timeout
        while not self._frames and self.now < end:
            self.now = min(max(self._board.next_wakeup(self.now), self.now + 1e-6), end)
            self._collect()
        return self._frames.pop(0) if self._frames else None

    def payload(self, frame: bytes, timeout: float = 1.0) -> bytes:
        answer = self.ask(frame, timeout)
        assert answer is not None
        return answer.payload

    def progress(self, frame: bytes) -> Staged:
        progress = decode_progress(self.payload(frame))
        assert progress is not None
        return progress

    def stored(self, frame: bytes) -> Stored:
        stored = decode_stored(self.payload(frame))
        assert stored is not None
        return stored

    def stage(self, records: Sequence[WpRecord]) -> None:
        """BEGIN and all CHUNKs, one at a time."""
        progress = self.progress(encode_begin(identify(records)))
        while progress.next < len(records):
            assert progress.status is ReplyStatus.OK
            progress = self.progress(encode_chunk(pack_records(records), progress.next, 15).frame)

    def push(self, records: Sequence[WpRecord]) -> Stored:
        """A complete upload; returns the reply to COMMIT."""
        self.stage(records)
        return self.stored(encode_commit(identify(records)))

    def pull(self) -> list[WpRecord]:
        """Read the stored list through the UART."""
        records: list[WpRecord] = []
        while True:
            answer = decode_records(self.payload(encode_read(len(records), 6)))
            assert answer is not None
            if answer.status is ReplyStatus.RANGE:
                return records
            assert (answer.status, answer.first) == (ReplyStatus.OK, len(records))
            records += answer.records

    def _collect(self) -> None:
        data = self._board.advance(self.now)
        self.received += data
        self._frames += self._parser.feed(data)


class Bench(WireBench):
    """A simulated Naze that has just booted at time 0."""

    def __init__(self, options: SimOptions | None = None, faults: Faults | None = None) -> None:
        self.naze = SimulatedNaze(options, faults)
        self.naze.power_on(-BOOT_SECONDS)
        self.naze.advance(0.0)
        super().__init__(self.naze)


def mission(count: int, seed: int = 0) -> list[WpRecord]:
    """A list of distinct plain waypoints; each `seed` gives a different list."""
    return [
        WpRecord(473_977_000 + seed * 977 + 31 * i, 85_456_000 - 17 * i, 20 + i % 50, 0, i % 2, 2, 0, 0)
        for i in range(count)
    ]
