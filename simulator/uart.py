# SPDX-License-Identifier: GPL-3.0-or-later
"""USART1 of the board: two wires at the baud rate, each with a ring (drv_uart.c)."""

from collections import deque

from simulator.options import Counters

_BITS_PER_BYTE = 10
# Times are floats in seconds: with this tolerance a byte that ends exactly now has ended.
_EPSILON_BYTES = 1e-3
#: The time that a finished frame may wait for the next one, to save wake-ups at both ends.
GATHER_SECONDS = 0.004


class Uart:
    """Bytes on their way in (`receive` to `read`) and out (`write` to `transmitted`)."""

    def __init__(self, baud: int, counters: Counters, ring_size: int = 256) -> None:
        self.baud = baud
        self._counters = counters
        self._size = ring_size
        self._byte_time = _BITS_PER_BYTE / baud
        # Incoming: bytes on the wire, as (time of the first start bit, bytes).
        self._wire: deque[tuple[float, bytes]] = deque()
        self._wire_free_at = 0.0
        self._unread = bytearray()
        # Outgoing: the ring, the running DMA transfer, and the end of each written burst.
        self._ring = bytearray(ring_size)
        self._head = 0
        self._tail = 0
        self._dma_left = 0
        self._dma_at = 0
        self._dma_time = 0.0
        self._sent = bytearray()
        self._burst_ends: deque[float] = deque()

    def set_baud(self, baud: int, now: float) -> None:
        """Reinitialise the UART, as the firmware does on arming: the rings are cleared."""
        self._transmit(now)
        self.baud = baud
        self._byte_time = _BITS_PER_BYTE / baud
        self._unread.clear()
        self._dma_left = 0
        self._head = self._tail
        self._burst_ends.clear()

    def power_off(self) -> None:
        """Drop all bytes in transit."""
        self._wire.clear()
        self._wire_free_at = 0.0
        self._unread.clear()
        self._dma_left = 0
        self._head = self._tail
        self._burst_ends.clear()
        self._sent.clear()

    # -- incoming --------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Put bytes on the RX wire, behind those already there."""
        if not data:
            return
        start = max(now, self._wire_free_at)
        self._wire.append((start, data))
        self._wire_free_at = start + len(data) * self._byte_time

    def next_arrival(self) -> float | None:
        """The arrival time of the next unread byte; in the past if it is in the ring."""
        if self._unread:
            return 0.0
        return self._wire[0][0] + self._byte_time if self._wire else None

    def last_arrival(self) -> float:
        """The arrival time of the last byte on the wire."""
        return self._wire_free_at

    def discard_arrived(self, now: float) -> None:
        """Drop bytes that arrived until `now`, while no receiver was running."""
        self._leave_wire(now)
        self._unread.clear()

    def keep_arrived(self, now: float) -> None:
        """Keep bytes that arrived unread until `now`; an overrun is then not counted against the client."""
        self._leave_wire(now)
        self._drop_lapped()

    def read(self, now: float) -> int | None:
        """The next unread byte; None if there is none."""
        self._arrive(now)
        return self._unread.pop(0) if self._unread else None

    def _arrive(self, now: float) -> None:
        self._leave_wire(now)
        if len(self._unread) >= self._size:
            # The DMA has overrun the reader, which sees only the distance between the two positions.
            self._counters.rx_overflows += 1
            self._drop_lapped()

    def _drop_lapped(self) -> None:
        if len(self._unread) >= self._size:
            del self._unread[: len(self._unread) - len(self._unread) % self._size]

    def _leave_wire(self, now: float) -> None:
        while self._wire:
            start, data = self._wire[0]
            count = min(int((now - start) / self._byte_time + _EPSILON_BYTES), len(data))
            if count <= 0:
                break
            self._unread += data[:count]
            if count == len(data):
                self._wire.popleft()
            else:
                self._wire[0] = (start + count * self._byte_time, data[count:])

    # -- outgoing --------------------------------------------------------------------------------------------

    def write(self, data: bytes, now: float) -> None:
        """Put bytes into the TX ring, which overwrites unsent bytes without a check."""
        self._transmit(now)
        outstanding = self._outstanding() + len(data)
        counters = self._counters
        counters.max_outstanding_reply_bytes = max(counters.max_outstanding_reply_bytes, outstanding)
        if outstanding >= self._size:
            counters.tx_overflows += 1
        for byte in data:
            self._ring[self._head] = byte
            self._head = (self._head + 1) % self._size
            if not self._dma_left:
                self._dma_time = now
                self._start_dma()
        self._burst_ends.append(self._dma_time + self._outstanding() * self._byte_time)

    def transmitted(self, now: float) -> bytes:
        """The bytes sent from the TX pin since the last call."""
        self._transmit(now)
        while self._burst_ends and self._burst_ends[0] <= now:
            self._burst_ends.popleft()
        sent = bytes(self._sent)
        self._sent.clear()
        return sent

    def next_departure(self) -> float | None:
        """The time for the next call of `transmitted`: the end of a burst, or of one soon after it."""
        if not self._burst_ends:
            return None
        latest = self._burst_ends[0] + GATHER_SECONDS
        return max(end for end in self._burst_ends if end <= latest)

    def _outstanding(self) -> int:
        return self._dma_left + (self._head - self._tail) % self._size

    def _start_dma(self) -> None:
        """Send up to the head, or to the ring's end first (uartTxDMA)."""
        self._dma_at = self._tail
        if self._head > self._tail:
            self._dma_left = self._head - self._tail
            self._tail = self._head
        else:
            self._dma_left = self._size - self._tail
            self._tail = 0

    def _transmit(self, now: float) -> None:
        while self._dma_left:
            count = min(int((now - self._dma_time) / self._byte_time + _EPSILON_BYTES), self._dma_left)
            if count <= 0:
                return
            self._sent += self._ring[self._dma_at : self._dma_at + count]
            self._dma_at += count
            self._dma_left -= count
            self._dma_time += count * self._byte_time
            if not self._dma_left and self._head != self._tail:
                self._start_dma()
