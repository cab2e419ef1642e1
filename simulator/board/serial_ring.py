# SPDX-License-Identifier: GPL-3.0-or-later
"""The serial port of a simulated MSP board: two wires at a baud rate, a receive ring, and a send queue.

Harakiri's own UART, whose transmit ring overwrites itself, is in uart.py.
"""

from collections import deque

from simulator.board.options import Counters
from simulator.board.receive_ring import EPSILON_BYTES, ReceiveRing


class SerialRing(ReceiveRing):
    """Bytes on their way in (`receive` to `read`) and out (`write` to `sent`)."""

    def __init__(self, baud: int | None, size: int, counters: Counters) -> None:
        super().__init__(baud, size, counters)
        self._leaving: deque[tuple[float, bytes]] = deque()
        self._tx_free_at = 0.0

    def power_off(self) -> None:
        super().power_off()
        self._leaving.clear()
        self._tx_free_at = 0.0

    def write(self, data: bytes, now: float) -> None:
        self._tx_free_at = max(now, self._tx_free_at) + len(data) * self._byte_time
        self._leaving.append((self._tx_free_at, data))
        unsent = sum(len(each) for _, each in self._leaving)
        self._counters.max_outstanding_reply_bytes = max(self._counters.max_outstanding_reply_bytes, unsent)

    def sent(self, now: float) -> bytes:
        """The frames whose last byte was sent until `now`, since the last call."""
        out = bytearray()
        while self._leaving and self._leaving[0][0] <= now + self._byte_time * EPSILON_BYTES:
            out += self._leaving.popleft()[1]
        return bytes(out)

    def next_departure(self) -> float | None:
        """When the next frame is completely sent."""
        return self._leaving[0][0] if self._leaving else None
