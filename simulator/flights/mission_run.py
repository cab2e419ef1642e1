# SPDX-License-Identifier: GPL-3.0-or-later
"""One flight of a mission list: the pilot switches GPS AUTO on, and watches until it ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightProgress, FlightReason
from simulator.flights.mission_upload import progress_of
from simulator.flights.pilot import HIGH, LOW, MIDDLE, Pilot
from simulator.flights.track import Track

_EVERY_S = 0.2
#: The time to keep watching after an end without landing, and after a stop.
_WATCH_S, _WATCH_STOPPED_S = 8.0, 5.0
#: The slowest flight that is waited for: m/s, and s for each record.
_SLOWEST, _FOR_RECORD_S = 0.4, 60.0
_START_HEIGHT = 8.0
#: The board looks at the switch within this time.
_SWITCH_S = 3.0
_STOPPED = {FlightPhase.HELD, FlightPhase.OFF}


@dataclass(frozen=True, slots=True)
class Report:
    """The board's report at a time."""

    at_s: float
    progress: FlightProgress


@dataclass(slots=True)
class MissionRun:
    """The result: the board's reports, and the true track since the switch."""

    records: Sequence[WpRecord]
    begun_s: float
    track: Track
    reports: list[Report] = field(default_factory=list)
    #: False if the flight was still going on at the deadline.
    has_ended: bool = False
    has_landed: bool = False
    has_crashed: bool = False

    @property
    def last(self) -> FlightProgress:
        return self.reports[-1].progress

    @property
    def reason(self) -> FlightReason:
        """The last reason that the board gave for a stop, or the end."""
        return next((r.progress.reason for r in reversed(self.reports) if r.progress.reason), FlightReason.NONE)

    @property
    def compass(self) -> str:
        """What the board has found out about the compass, to end a sentence."""
        found = [report.progress.compass for report in self.reports if report.progress.compass is not None]
        return f"; the compass was found {found[-1]:.0f} degrees off" if found and abs(found[-1]) >= 1 else ""

    def reached_at(self, number: int) -> float | None:
        """When the board reported this record, or a later one, as reached."""
        for report in self.reports:
            reached = report.progress.reached
            if reached is not None and reached >= number:
                return report.at_s
        return None

    def in_state(self, number: int, *states: FlightPhase) -> tuple[float, float] | None:
        """From when to when the board was in one of these states with a record."""
        times = [r.at_s for r in self.reports if r.progress.record == number and r.progress.state in states]
        return (times[0], times[-1]) if times else None


Intervention = Callable[[Pilot, FlightProgress], None]


def fly_mission(pilot: Pilot, records: Sequence[WpRecord], intervene: Intervention = lambda *_: None) -> MissionRun:
    """Arm, take off (by hand if the list lacks a TAKEOFF), switch GPS AUTO on, and watch. PilotError."""
    pilot.arm()
    switches = pilot.naze.faults
    if len(records) > 1 and records[1].command == WpCommand.TAKEOFF:
        pilot.fly_mission()
        pilot.wait(0.5)
        switches.throttle = MIDDLE
    else:
        pilot.take_off(_START_HEIGHT)
        pilot.wait(10.0)
        pilot.fly_mission()
    run = MissionRun(records, pilot.now, Track())
    deadline_s = pilot.now + _longest_s(pilot, records)
    end_s: float | None = None
    while pilot.now < deadline_s and (end_s is None or pilot.now < end_s):
        pilot.wait(_EVERY_S)
        progress = progress_of(pilot.console)
        if progress is None:
            continue
        run.reports.append(Report(pilot.now, progress))
        if pilot.height > 1.0 and switches.aux2 == LOW:
            switches.aux2 = HIGH
        intervene(pilot, progress)
        run.has_landed = not pilot.naze.armed
        if end_s is None and pilot.now > run.begun_s + _SWITCH_S:
            watch_s = _ends(progress, run.has_landed)
            run.has_ended = watch_s is not None
            end_s = None if watch_s is None else pilot.now + watch_s
    run.track = pilot.track.since(run.begun_s)
    run.has_crashed = pilot.naze.sky.body.has_crashed
    return run


def _ends(progress: FlightProgress, has_landed: bool) -> float | None:
    """The time to keep watching if the flight has ended, or None if it continues."""
    if has_landed:
        return 1.0
    if progress.state in (FlightPhase.DONE, FlightPhase.STAY):
        return _WATCH_S
    return _WATCH_STOPPED_S if progress.state in _STOPPED else None


def _longest_s(pilot: Pilot, records: Sequence[WpRecord]) -> float:
    place, metres, seconds = (0.0, 0.0), 0.0, 60.0
    for record in records:
        seconds += _FOR_RECORD_S + record.time + 72.0 * abs(record.turns)
        if record.lat_e7 or record.lon_e7:
            here = pilot.naze.sky.place.position(record.lat_e7 / 1e7, record.lon_e7 / 1e7)
            metres += abs(here[0] - place[0]) + abs(here[1] - place[1])
            place = here
    return seconds + metres / _SLOWEST
