# SPDX-License-Identifier: GPL-3.0-or-later
"""Replies that a stalled flight controller may send all at once when it resumes. Sans-IO.

Harakiri's send ring has no overflow check (bridge.line.msp_link). While a silent board is searched for, it may still
answer each probe at its own speed later: together with earlier requests, these replies must fit the ring.
"""

#: Harakiri's ring, less one heartbeat (25 bytes) that it may send unasked in AUTOSENSE, and a margin.
MAX_OUTSTANDING_BYTES = 224
#: After a longer stall, pending requests are assumed lost: the board was reset or lost power.
LONGEST_STALL_S = 3.0


def byte_time_s(baud: int | None) -> float:
    """A byte's time on a line, with its start and stop bits; 0 where the line has no speed."""
    return 10 / baud if baud else 0.0


class PendingReplies:
    """Pending reply bytes, by the speed of their requests: at another speed the board understood nothing."""

    def __init__(self) -> None:
        self._owed: dict[int | None, list[tuple[float, int]]] = {}  # until when, bytes; the oldest first

    def add(self, speed: int | None, size: int, asked_at: float) -> None:
        """Add a request whose reply has `size` bytes."""
        self._owed.setdefault(speed, []).append((asked_at + LONGEST_STALL_S, size))

    def room(self, speed: int | None, now: float) -> int:
        """The largest reply that still fits, bytes."""
        return MAX_OUTSTANDING_BYTES - self.size(speed, now)

    def size(self, speed: int | None, now: float) -> int:
        """The bytes that may still arrive."""
        return sum(size for _, size in self._present(speed, now))

    def questions(self, speed: int | None, now: float) -> int:
        """The number of requests that may still be answered."""
        return len(self._present(speed, now))

    def heard(self, speed: int | None, size: int, now: float) -> None:
        """The board has resumed with a reply of `size` bytes (0: with other data), so the rest is on its way."""
        rest: list[tuple[float, int]] = []
        left_ring_at = now
        for until, owed in self._present(speed, now):
            paid = min(owed, size)
            size -= paid
            if owed > paid:
                left_ring_at += (owed - paid) * byte_time_s(speed)
                rest.append((min(until, left_ring_at), owed - paid))
        self._owed = {speed: rest}

    def _present(self, speed: int | None, now: float) -> list[tuple[float, int]]:
        owed = [entry for entry in self._owed.get(speed, ()) if now < entry[0]]
        self._owed[speed] = owed
        return owed
