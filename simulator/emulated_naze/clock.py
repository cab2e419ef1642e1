# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board's time, in nanoseconds, and its peripherals' alarms."""

from collections.abc import Callable
from heapq import heappop, heappush

NEVER_NS = 1 << 62


class Clock:
    """Time only moves forward, by `advance`, and also while the board has no power."""

    def __init__(self) -> None:
        self.now_ns = 0
        #: The time of the next alarm, or earlier: a cancelled alarm may still be in the queue.
        self.next_ns = NEVER_NS
        self._queue: list[tuple[int, int, Alarm]] = []
        self._entries = 0

    def advance(self, to_ns: int) -> None:
        """Move the time to `to_ns`, and run the alarms due by then, each at its own time."""
        while self.next_ns <= to_ns:
            at_ns, _, alarm = heappop(self._queue)
            self.next_ns = self._queue[0][0] if self._queue else NEVER_NS
            if alarm.at_ns == at_ns:
                self.now_ns = max(self.now_ns, at_ns)
                alarm.go_off()
        self.now_ns = max(self.now_ns, to_ns)

    def enqueue(self, alarm: "Alarm") -> None:
        """Add an alarm that was set."""
        self._entries += 1
        heappush(self._queue, (alarm.at_ns, self._entries, alarm))
        self.next_ns = min(self.next_ns, alarm.at_ns)


class Alarm:
    """Calls back once; until then its time can be changed."""

    def __init__(self, clock: Clock, callback: Callable[[], None]) -> None:
        self._clock = clock
        self._callback = callback
        self.at_ns = NEVER_NS

    @property
    def is_set(self) -> bool:
        return self.at_ns != NEVER_NS

    def set_in(self, delay_ns: int) -> None:
        """Set or move it to `delay_ns` from now."""
        self.set_at(self._clock.now_ns + delay_ns)

    def set_at(self, at_ns: int) -> None:
        """Set or move it to a time."""
        self.at_ns = at_ns
        self._clock.enqueue(self)

    def cancel(self) -> None:
        self.at_ns = NEVER_NS

    def go_off(self) -> None:
        """Call back; called by the clock."""
        self.at_ns = NEVER_NS
        self._callback()
