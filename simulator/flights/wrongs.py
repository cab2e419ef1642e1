# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in one flight, as the command line names it."""

from collections.abc import Sequence
from math import isfinite

from protocols.msp.mission_flight import FlightProgress
from simulator.flights.pilot import Pilot
from simulator.sky.lies import NAMES, OUTAGE, Lies

#: The GPS jumps, or loses its fix, this long after the flight began.
_EVENT_S = 20.0
_JUMP = "gps-jump"


class Wrongs:
    """`told`: NAME=VALUE each. ValueError, with a sentence."""

    def __init__(self, told: Sequence[str]) -> None:
        self.lies = Lies()
        self._events = {_JUMP: 0.0, OUTAGE: 0.0}
        self._begun_s: float | None = None
        for each in told:
            name, value = _read(each)
            if name in self._events:
                self._events[name] = value
            else:
                setattr(self.lies, name.replace("-", "_"), value)

    def happen(self, pilot: Pilot, _: FlightProgress) -> None:
        """At every report of the board."""
        if self._begun_s is None:
            self._begun_s = pilot.now
        since = pilot.now - self._begun_s - _EVENT_S
        self.lies.gps_jump = self._events[_JUMP] if since > 0 else 0.0
        pilot.naze.faults.gps_fix = not 0 < since < self._events[OUTAGE]


def _read(told: str) -> tuple[str, float]:
    name, _, text = told.partition("=")
    if name not in NAMES:
        raise ValueError(f"--lie {told}: {name!r} is none of {', '.join(NAMES)}")
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ValueError(f"--lie {told}: {text!r} is no number: write --lie {name}=5")
    return name, value
