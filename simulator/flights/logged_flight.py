# SPDX-License-Identifier: GPL-3.0-or-later
"""A real flight of a mission from the bridge's telemetry log, as a sortie: it is judged like a simulated flight.

The track is the board's own: the GPS, the height and the attitude.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import acos, cos, degrees

from protocols.mavlink.codec import decode
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MAGIC_V1, MavlinkFrame
from protocols.msp.mission import WpRecord
from protocols.msp.mission_flight import SUMMARY, FlightPhase, FlightProgress, decode_summary
from simulator.flights.judgement import extremes, judge
from simulator.flights.mission_run import MissionRun, Report
from simulator.flights.sortie import Sortie, SortieError
from simulator.flights.track import Sample, Track
from simulator.sky.earth import Place

_EVERY_S = 0.1
#: A flight that ends so has ended by itself, else the log does.
_ENDED = (FlightPhase.OFF, FlightPhase.DONE, FlightPhase.STAY, FlightPhase.HELD)


@dataclass(slots=True)
class _Log:
    """The values last heard, and what they add up to."""

    place: Place
    track: Track = field(default_factory=Track)
    reports: list[Report] = field(default_factory=list)
    begun_s: float | None = None
    is_armed: bool = False
    heading: float = 0.0
    tilt: float = 0.0
    reached: int | None = None

    def take(self, at_s: float, message: Message) -> None:
        match message.get_type():
            case "HEARTBEAT" if message.type != messages.MAV_TYPE_GCS:
                self.is_armed = bool(message.base_mode & messages.MAV_MODE_FLAG_SAFETY_ARMED)
            case "ATTITUDE":
                self.heading = degrees(message.yaw) % 360
                self.tilt = degrees(acos(cos(message.roll) * cos(message.pitch)))
            case "GLOBAL_POSITION_INT":
                self._note(at_s, message)
            case "MISSION_ITEM_REACHED":
                self.reached = message.seq
            case "NAMED_VALUE_INT" if message.name == SUMMARY:
                self._report(at_s, decode_summary(message.value))

    def _note(self, at_s: float, message: Message) -> None:
        """Between two positions the former is repeated, ten times a second as in a simulated track."""
        while self.track.samples and self.track.last.at_s + 2 * _EVERY_S <= at_s:
            self.track.samples.append(replace(self.track.last, at_s=self.track.last.at_s + _EVERY_S))
        north, west = self.place.position(message.lat / 1e7, message.lon / 1e7)
        position = north, west, message.relative_alt / 1000
        velocity = message.vx / 100, -message.vy / 100, -message.vz / 100
        self.track.samples.append(Sample(at_s, position, velocity, self.heading, self.tilt, self.is_armed))
        if self.reports:  # they are sent when they change
            self.reports.append(Report(at_s, replace(self.reports[-1].progress, reached=self.reached)))

    def _report(self, at_s: float, progress: FlightProgress | None) -> None:
        if progress is None or not (self.is_armed or self.reports):
            return
        if self.begun_s is None and progress.in_command:
            self.begun_s, self.reached = at_s, None
        self.reports.append(Report(at_s, replace(progress, reached=self.reached)))


def logged_sortie(log: bytes, records: Sequence[WpRecord]) -> Sortie:
    """The first flight of this list in a log. SortieError if there is none."""
    kept = _Log(Place(lat=records[0].lat_e7 / 1e7, lon=records[0].lon_e7 / 1e7))
    for at_s, message in _messages(log):
        kept.take(at_s, message)
        if kept.begun_s is not None and not kept.is_armed:
            break
    if kept.begun_s is None or not kept.track.samples:
        raise SortieError("the log has no mission flight: it needs a flight of a Harakiri with mission_fly 1")
    run = MissionRun(records, kept.begun_s, kept.track.since(kept.begun_s), kept.reports)
    run.has_landed = not kept.is_armed
    run.has_ended = run.has_landed or run.last.state in _ENDED
    return Sortie(run, kept.place, judge(run, kept.place), extremes(run, kept.place))


def _messages(log: bytes) -> Iterator[tuple[float, Message]]:
    """Each message with the time, s. A record that is cut off ends the log."""
    at = 0
    while at + 10 < len(log):
        start = at + 8
        end = start + log[start + 1] + (8 if log[start] == MAGIC_V1 else 12)
        message = decode(MavlinkFrame(log[start:end])) if end <= len(log) else None
        if message is not None:
            yield int.from_bytes(log[at:start], "big") / 1e6, message
        at = end
