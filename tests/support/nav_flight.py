# SPDX-License-Identifier: GPL-3.0-or-later
"""A list flown to its end, in the words of the table in docs/inav.md: by simulated boards, or by INAV's own SITL."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from bridge.model.ground_track import Place, distance_m
from protocols.msp.nav import FINISHED, LEGS, NavAction, NavRecord, NavState, NavStatus

TOO_FAR, HOLDS_FOR_EVER = 1, 3
USUAL_MS, USUAL_M, SHORT_M = 3.0, 20.0, 5.0


@dataclass
class Leg:
    """A record that was flown to, the seconds held there, and the speeds on the way, m/s."""

    number: int
    held_s: float = 0.0
    speeds: list[float] = field(default_factory=list)


class NavFlight(ABC):
    """A board that flies a list. longest_s: a list that still flies then never ends."""

    longest_s = 600.0
    sample_s = 0.2

    def __init__(self, records: tuple[NavRecord, ...]) -> None:
        self._last = records[-1]
        self.legs: list[Leg] = []

    @abstractmethod
    def now_s(self) -> float: ...

    @abstractmethod
    def run(self, seconds: float) -> None: ...

    @abstractmethod
    def status(self) -> NavStatus: ...

    @abstractmethod
    def place(self) -> Place: ...

    @abstractmethod
    def height_m(self) -> float: ...

    @abstractmethod
    def speed_ms(self) -> float: ...

    @abstractmethod
    def is_landed(self, status: NavStatus) -> bool: ...

    @abstractmethod
    def height_is_steady(self) -> bool: ...

    def cruise_ms(self, leg: Leg) -> float:
        """The first sample may still belong to the previous leg."""
        return max(leg.speeds[1:] or leg.speeds)

    def fly(self) -> str:
        began_s = before_s = self.now_s()
        while self.now_s() < began_s + self.longest_s:
            self.run(self.sample_s)
            status = self.status()
            seconds, before_s = self.now_s() - before_s, self.now_s()
            if self.legs and self.is_landed(status):
                return "lands at home" if status.action == NavAction.RTH else "lands"
            if status.error == TOO_FAR:
                return "stops"
            if status.action in (NavAction.JUMP, NavAction.SET_POI, NavAction.SET_HEAD) or not status.state:
                if status.error == FINISHED and self.height_is_steady():
                    return "hovers"
                continue
            if not self.legs or self.legs[-1].number != status.number:
                self.legs.append(Leg(status.number))
            elif status.state == NavState.HOLD_TIMED:
                self.legs[-1].held_s += seconds
            self.legs[-1].speeds.append(self.speed_ms())
            if status.action == NavAction.RTH and status.state in (NavState.HOVER_ABOVE_HOME, HOLDS_FOR_EVER):
                return "hovers at home"
            if status.error == FINISHED and self.height_is_steady():
                return "lands" if status.action == NavAction.LAND else "hovers"
        return "(stays)" if self.legs[-1].held_s > self.longest_s / 2 else "never ends"

    def summary(self) -> str:
        """The table's text: only unusual facts are given."""
        end = self.fly()
        if end == "never ends":
            return end
        words = []
        for leg in self.legs:
            words.append(str(leg.number))
            if leg.held_s > 1 and end != "(stays)":
                words.append(f"({round(leg.held_s)} s)")
            if (speed := self.cruise_ms(leg)) > USUAL_MS + 0.1:
                words.append(f"({speed:g} m/s)")
        is_low = end == "hovers" and abs(self.height_m() - USUAL_M) > 0.5
        is_short = end == "hovers" and self._last.action in LEGS and distance_m(self.place(), self._last) > SHORT_M
        return " ".join([*words, end]) + f" at {self.height_m():g} m" * is_low + " short of it" * is_short
