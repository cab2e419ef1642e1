# SPDX-License-Identifier: GPL-3.0-or-later
"""The serial port of a simulated MSP board: two wires at a baud rate, a receive ring, and a send queue.

Harakiri's own UART, whose transmit ring overwrites itself, is in uart.py.
"""

from collections import deque

from simulator.options import Counters

_BITS_PER_BYTE = 10
# Times are floats in seconds: with this tolerance a byte that ends exactly now has ended.
_EPSILON_BYTES = 1e-3


class SerialRing:
    """`baud` None: a socket, on which bytes take no time. `size`: of the receive ring, bytes."""

    def __init__(self, baud: int | None, size: int, counters: Counters) -> None:
        self._byte_time = _BITS_PER_BYTE / baud if baud else 0.0
        self._size = size
        self._counters = counters
        self._arriving: deque[tuple[float, bytes]] = deque()
        self._rx_free_at = 0.0
        self._unread = bytearray()
        self._leaving: deque[tuple[float, bytes]] = deque()
        self._tx_free_at = 0.0

    def clear(self) -> None:
        """Drop all bytes in transit, as without power."""
        self._arriving.clear()
        self._unread.clear()
        self._leaving.clear()
        self._rx_free_at = self._tx_free_at = 0.0

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the wire to the board, behind those already there."""
        if data:
            start = max(now, self._rx_free_at)
            self._arriving.append((start, data))
            self._rx_free_at = start + len(data) * self._byte_time

    def next_arrival(self) -> float | None:
        """The arrival time of the next byte; in the past if it is in the ring."""
        if self._unread:
            return 0.0
        return self._arriving[0][0] + self._byte_time if self._arriving else None

    def last_arrival(self) -> float:
        """The arrival time of the last byte on the wire."""
        return self._rx_free_at

    def arrive(self, now: float) -> int:
        """Move the bytes that arrived until `now` into the ring; returns the number of readable bytes.

        The firmware does not notice an overrun: it sees only the distance between the two positions.
        """
        while self._arriving:
            start, data = self._arriving[0]
            count = len(data)
            if self._byte_time:
                count = min(int((now - start) / self._byte_time + _EPSILON_BYTES), count)
            elif start > now:
                count = 0
            if count <= 0:
                break
            self._unread += data[:count]
            if count == len(data):
                self._arriving.popleft()
            else:
                self._arriving[0] = (start + count * self._byte_time, data[count:])
        if len(self._unread) >= self._size:
            self._counters.rx_overflows += 1
            del self._unread[: len(self._unread) - len(self._unread) % self._size]
        return len(self._unread)

    def read(self) -> int | None:
        """The next byte of the ring; None if it is empty."""
        return self._unread.pop(0) if self._unread else None

    def write(self, data: bytes, now: float) -> None:
        """Send."""
        self._tx_free_at = max(now, self._tx_free_at) + len(data) * self._byte_time
        self._leaving.append((self._tx_free_at, data))
        unsent = sum(len(each) for _, each in self._leaving)
        self._counters.max_outstanding_reply_bytes = max(self._counters.max_outstanding_reply_bytes, unsent)

    def sent(self, now: float) -> bytes:
        """The frames whose last byte was sent until `now`, since the last call."""
        out = bytearray()
        while self._leaving and self._leaving[0][0] <= now + self._byte_time * _EPSILON_BYTES:
            out += self._leaving.popleft()[1]
        return bytes(out)

    def next_departure(self) -> float | None:
        """The time at which the next frame is completely sent."""
        return self._leaving[0][0] if self._leaving else None
