"""What a flight controller that stands still may answer all at once when it goes on. Sans-IO.

Harakiri's send ring has no overflow check (bridge.msp_link). Whoever is silent is searched for, and each question that
it is asked at its own speed may still be answered: with what was asked before, they must fit the ring.
"""

from bridge.msp_link import LONGEST_STALL_S, MAX_OUTSTANDING_BYTES


class ReplyDebt:
    """Reply bytes that are owed, by the speed at which they were asked for: at another one nothing is understood."""

    def __init__(self) -> None:
        self._owed: dict[int | None, list[tuple[float, int]]] = {}  # asked when, bytes

    def add(self, speed: int | None, size: int, asked_at: float) -> None:
        """Take note of a question whose reply has `size` bytes."""
        self._owed.setdefault(speed, []).append((asked_at, size))

    def room(self, speed: int | None, now: float) -> int:
        """Return how long the reply to another question may be."""
        return MAX_OUTSTANDING_BYTES - sum(size for _, size in self._present(speed, now))

    def questions(self, speed: int | None, now: float) -> int:
        """Return how many questions may still be answered."""
        return len(self._present(speed, now))

    def settle(self) -> None:
        """Somebody has spoken: it goes on, and has answered all that it will."""
        self._owed.clear()

    def _present(self, speed: int | None, now: float) -> list[tuple[float, int]]:
        owed = [entry for entry in self._owed.get(speed, ()) if now < entry[0] + LONGEST_STALL_S]
        self._owed[speed] = owed
        return owed
