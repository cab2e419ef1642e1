# SPDX-License-Identifier: GPL-3.0-or-later
"""USART1 of the board: two wires at the baud rate, each with a ring (drv_uart.c)."""

from collections import deque

from simulator.board.options import Counters
from simulator.board.receive_ring import EPSILON_BYTES, GATHER_SECONDS, ReceiveRing

#: The longest time that a port holds bytes back while more arrive.
_LONGEST_READ_S = 0.02


class Uart(ReceiveRing):
    """Bytes on their way in (`receive` to `read`) and out (`write` to `transmitted`)."""

    def __init__(self, baud: int, counters: Counters, ring_size: int = 256) -> None:
        super().__init__(baud, ring_size, counters)
        self.baud = baud
        # The ring, the running DMA transfer, and the end of each written burst.
        self._ring = bytearray(ring_size)
        self._head = 0
        self._tail = 0
        self._dma_left = 0
        self._dma_at = 0
        self._dma_time = 0.0
        self._sent = bytearray()
        self._burst_ends: deque[float] = deque()
        self._read_at = 0.0

    def set_baud(self, baud: int, now: float) -> None:
        """Reinitialise the UART, as the firmware does on arming: the rings are cleared."""
        self._transmit(now)
        self.baud = baud
        self._set_speed(baud)
        self._unread.clear()
        self._drop_unsent()

    def power_off(self) -> None:
        super().power_off()
        self._drop_unsent()
        self._sent.clear()

    def _drop_unsent(self) -> None:
        self._dma_left = 0
        self._head = self._tail
        self._burst_ends.clear()

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
        self._read_at = now
        while self._burst_ends and self._burst_ends[0] <= now:
            self._burst_ends.popleft()
        sent = bytes(self._sent)
        self._sent.clear()
        return sent

    def next_departure(self) -> float | None:
        """The time for the next call of `transmitted`: the end of a burst, or of one soon after it.

        Within a long burst on a slow line it is earlier, as a port passes bytes on while more arrive.
        """
        if not self._burst_ends:
            return None
        latest = self._burst_ends[0] + GATHER_SECONDS
        burst = max(end for end in self._burst_ends if end <= latest)
        return min(burst, max(self._read_at, self._dma_time) + _LONGEST_READ_S)

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
            count = min(int((now - self._dma_time) / self._byte_time + EPSILON_BYTES), self._dma_left)
            if count <= 0:
                return
            self._sent += self._ring[self._dma_at : self._dma_at + count]
            self._dma_at += count
            self._dma_left -= count
            self._dma_time += count * self._byte_time
            if not self._dma_left and self._head != self._tail:
                self._start_dma()
