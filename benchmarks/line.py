# SPDX-License-Identifier: GPL-3.0-or-later
"""A line between an autopilot and a ground station, both in this process, with a forwarder between them.

The autopilot writes numbered and timestamped MAVLink 2 frames into a pseudo-terminal; the ground station receives
datagrams of whole frames on the loopback.
"""

import os
import pty
import select
import socket
import struct
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from fastcrc.crc16 import mcrf4xx

from benchmarks.processes import BenchmarkError
from protocols.mavlink.dialect import CRC_EXTRA, messages

_SYSID, _COMPID = 1, 1
_MAGIC_V2, _SIGNED = 0xFD, 0x01
_HEADER_SIZE, _CRC_SIZE, _SIGNATURE_SIZE = 10, 2, 13
#: RAW_IMU, with the time of sending in its time field and the number in its first two axes.
_TIMED = messages.MAVLINK_MSG_ID_RAW_IMU
_TIMED_PAYLOAD = struct.Struct("<QI7hBh")
_NUMBER_AND_TIME = struct.Struct("<QI")
_AXES = (-7, 11, 980, 3, -2, 1, 230)
_QUADROTOR = 2
_HEARTBEAT = struct.pack("<IBBBBB", 0, _QUADROTOR, messages.MAV_AUTOPILOT_ARDUPILOTMEGA, 81, 3, 3)
_HEARTBEAT_INTERVAL_NS = 1_000_000_000
#: Unpaced: frames sent at once, and frames in flight. A terminal holds 4096 bytes, and no frame may be lost because
#: this process was too slow to read it.
_BURST, _UNDER_WAY = 32, 96
_WARM_UP_RATE, _WARM_UP_FRAMES, _TIMEOUT_S = 100.0, 50, 30.0
_LAST_ONES_S = 0.5
_READ_SIZE = 65536


@dataclass(slots=True)
class Passage:
    """The frames sent at one end, and those received at the other."""

    sent: int = 0
    numbers: set[int] = field(default_factory=set)
    latencies_s: list[float] = field(default_factory=list)

    @property
    def lost(self) -> int:
        """The number of frames that did not arrive."""
        return self.sent - len(self.numbers)


class Line:
    """`tty`: the path for the forwarder to open; `port`: the UDP port of the loopback for it to send to."""

    def __init__(self) -> None:
        self._autopilot, self._held_open = pty.openpty()
        tty.setraw(self._held_open)
        os.set_blocking(self._autopilot, False)
        self.tty = os.ttyname(self._held_open)
        self._ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._ground.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self._ground.bind(("127.0.0.1", 0))
        self._ground.setblocking(False)
        self.port: int = self._ground.getsockname()[1]
        self._seq = 0
        self._number = 0
        self._heartbeat_at_ns = 0

    def close(self) -> None:
        os.close(self._autopilot)
        os.close(self._held_open)
        self._ground.close()

    def warm_up(self) -> None:
        """Send until enough frames arrive; BenchmarkError if none ever does."""
        end = time.monotonic() + _TIMEOUT_S
        while time.monotonic() < end:
            if len(self.pass_on(_WARM_UP_RATE, 1.0).numbers) > _WARM_UP_FRAMES:
                return
        raise BenchmarkError(f"no frame arrived within {_TIMEOUT_S:.0f} s")

    def pass_on(self, rate: float | None, seconds: float) -> Passage:
        """Send frames at a rate per second, or as fast as they get through (None), and wait for the last ones."""
        passage = Passage()
        first = self._number
        due = time.monotonic_ns()
        end = due + int(seconds * 1e9)
        given_up = 0
        while (now := time.monotonic_ns()) < end:
            self._send_heartbeat(now)
            if rate is not None:
                if now >= due:
                    self._send_timed(passage, 1)
                    due += int(1e9 / rate)
                self._receive(passage, first, max(0, due - time.monotonic_ns()) / 1e9)
            elif passage.lost - given_up <= _UNDER_WAY - _BURST:
                self._send_timed(passage, _BURST)
                self._receive(passage, first, 0)
            elif not self._receive(passage, first, _LAST_ONES_S):
                given_up = passage.lost
        while self._receive(passage, first, _LAST_ONES_S):
            pass
        return passage

    def frame(self, msgid: int, payload: bytes) -> bytes:
        """The autopilot's next frame."""
        self._seq = (self._seq + 1) & 0xFF
        body = bytes((len(payload), 0, 0, self._seq, _SYSID, _COMPID)) + msgid.to_bytes(3, "little") + payload
        return b"\xfd" + body + mcrf4xx(body + CRC_EXTRA[msgid]).to_bytes(_CRC_SIZE, "little")

    def _send_timed(self, passage: Passage, count: int) -> None:
        self._write(b"".join(self._timed_frame() for _ in range(count)))
        passage.sent += count

    def _timed_frame(self) -> bytes:
        payload = _TIMED_PAYLOAD.pack(time.monotonic_ns(), self._number, *_AXES, 0, 2500)
        self._number += 1
        return self.frame(_TIMED, payload)

    def _send_heartbeat(self, now_ns: int) -> None:
        if now_ns >= self._heartbeat_at_ns:
            self._heartbeat_at_ns = now_ns + _HEARTBEAT_INTERVAL_NS
            self._write(self.frame(messages.MAVLINK_MSG_ID_HEARTBEAT, _HEARTBEAT))

    def _write(self, data: bytes) -> None:
        while data:
            _, writable, _ = select.select([], [self._autopilot], [], _TIMEOUT_S)
            if not writable:
                raise BenchmarkError(f"the forwarder has read nothing for {_TIMEOUT_S:.0f} s")
            data = data[os.write(self._autopilot, data) :]

    def _receive(self, passage: Passage, first: int, timeout_s: float) -> bool:
        """Receive frames; False if none arrived."""
        frames = self._frames(timeout_s)
        now = time.monotonic_ns()
        for frame in frames:
            if frame[7] == _TIMED:
                sent_at, number = _NUMBER_AND_TIME.unpack_from(frame, _HEADER_SIZE)
                if number >= first:
                    passage.numbers.add(number)
                    passage.latencies_s.append((now - sent_at) / 1e9)
        return bool(frames)

    def _frames(self, timeout_s: float) -> list[bytes]:
        """Wait for datagrams; returns the frames of those that arrived."""
        end = time.monotonic() + timeout_s
        while True:
            ends = [self._ground.fileno(), self._autopilot]
            readable, _, _ = select.select(ends, [], [], max(0, end - time.monotonic()))
            if self._autopilot in readable:
                os.read(self._autopilot, _READ_SIZE)  # the forwarder's output to the autopilot is not used
            if self._ground.fileno() in readable:
                return [frame for datagram in self._datagrams() for frame in _whole_frames(datagram)]
            if time.monotonic() >= end:
                return []

    def _datagrams(self) -> Iterator[bytes]:
        while True:
            try:
                yield self._ground.recv(_READ_SIZE)
            except BlockingIOError:
                return


def _whole_frames(datagram: bytes) -> Iterator[bytes]:
    """Split by the sizes in the headers, regardless of the CRCs."""
    start = 0
    while start < len(datagram):
        end = len(datagram)
        if datagram[start] == _MAGIC_V2 and end - start >= _HEADER_SIZE:
            signature = _SIGNATURE_SIZE if datagram[start + 2] & _SIGNED else 0
            end = start + _HEADER_SIZE + datagram[start + 1] + _CRC_SIZE + signature
        yield datagram[start:end]
        start = end


@contextmanager
def on_cpu(cpu: int) -> Iterator[None]:
    """Keep this process and its children on one CPU."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {cpu})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
