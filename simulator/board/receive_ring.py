# SPDX-License-Identifier: GPL-3.0-or-later
"""The receiving half of a board's serial port: a wire at a baud rate, and the ring that the DMA fills from it."""

from collections import deque

from simulator.board.options import Counters

_BITS_PER_BYTE = 10
# Times are floats in seconds: with this tolerance a byte that ends exactly now has ended.
EPSILON_BYTES = 1e-3
#: The time that a finished frame may wait for the next, to save wake-ups at both ends.
GATHER_SECONDS = 0.004


class ReceiveRing:
    """`baud` None: a socket, on which bytes arrive at once. `size`: of the ring, bytes."""

    def __init__(self, baud: int | None, size: int, counters: Counters) -> None:
        self._set_speed(baud)
        self._size = size
        self._counters = counters
        # Bytes on the wire, as (time of the first start bit, bytes).
        self._wire: deque[tuple[float, bytes]] = deque()
        self._wire_free_at = 0.0
        self._unread = bytearray()

    def _set_speed(self, baud: int | None) -> None:
        self._byte_time = _BITS_PER_BYTE / baud if baud else 0.0

    def power_off(self) -> None:
        self._wire.clear()
        self._wire_free_at = 0.0
        self._unread.clear()

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the RX wire, after those already there."""
        if data:
            start = max(now, self._wire_free_at)
            self._wire.append((start, data))
            self._wire_free_at = start + len(data) * self._byte_time

    def next_arrival(self) -> float | None:
        """The arrival time of the next unread byte. In the past if it is in the ring."""
        if self._unread:
            return 0.0
        return self._wire[0][0] + self._byte_time if self._wire else None

    def last_arrival(self) -> float:
        """The arrival time of the last byte on the wire."""
        return self._wire_free_at

    def read(self, now: float) -> int | None:
        """The next unread byte, or None if there is none."""
        if self._wire:
            self._leave_wire(now)
        unread = self._unread
        if len(unread) >= self._size:
            self.arrive(now)
        return unread.pop(0) if unread else None

    def arrive(self, now: float) -> int:
        """Fill the ring. Returns the number of unread bytes.

        The firmware does not notice an overrun: it sees only the distance between the DMA's position and its own.
        """
        self._leave_wire(now)
        if len(self._unread) >= self._size:
            self._counters.rx_overflows += 1
            self._drop_lapped()
        return len(self._unread)

    def discard_arrived(self, now: float) -> None:
        """Drop bytes that arrived until `now`, while no receiver was running."""
        self._leave_wire(now)
        self._unread.clear()

    def keep_arrived(self, now: float) -> None:
        """Keep bytes that arrived unread until `now`. An overrun is then not counted against the client."""
        self._leave_wire(now)
        self._drop_lapped()

    def _drop_lapped(self) -> None:
        if len(self._unread) >= self._size:
            del self._unread[: len(self._unread) - len(self._unread) % self._size]

    def _leave_wire(self, now: float) -> None:
        while self._wire:
            start, data = self._wire[0]
            count = len(data)
            if self._byte_time:
                count = min(int((now - start) / self._byte_time + EPSILON_BYTES), count)
            elif start > now:
                count = 0
            if count <= 0:
                break
            self._unread += data[:count]
            if count == len(data):
                self._wire.popleft()
            else:
                self._wire[0] = (start + count * self._byte_time, data[count:])
