# SPDX-License-Identifier: GPL-3.0-or-later
"""Judges by the craft's true track whether a mission was flown as the list says.

The limits: a place within its radius + 2 m, 3 m of overshoot where it brakes, 1.5 s of a time, 10 degrees of a turn, a
place that is held within its radius + 4 m and the height within 1.5 m, a landing within 6 m of where the descent began.
They include the GPS module's error of 1 m.

A flight is out of bounds, however it ends, 40 m from all legs of the list, at 12 m/s or leaning 50 degrees.
"""

from dataclasses import dataclass, field
from itertools import pairwise, starmap
from math import hypot

from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.mission_flight import FlightPhase, FlightReason
from simulator.flights.mission_run import MissionRun
from simulator.flights.track import Track
from simulator.sky.earth import Place

_PLACE_M, _OVERSHOOT_M, _HELD_M, _LANDED_M = 2.0, 3.0, 4.0, 6.0
_SECONDS, _TURN_DEG, _TAKEOFF_M, _HOLD_HEIGHT_M = 1.5, 10.0, 1.0, 1.5
_OVERSHOOT_S = 10.0
_FLYAWAY_M, _FASTEST, _STEEPEST_DEG = 40.0, 12.0, 50.0
#: The board is asked this often, so a turn began up to this long before it was seen.
_REPORT_S = 0.3
_MOVING = {*WpCommand} - {WpCommand.LAND, WpCommand.TAKEOFF, WpCommand.SETROI}
#: The least radius: the firmware's default gps_wp_radius.
_LEAST_RADIUS_M = 2.0


@dataclass(slots=True)
class ItemResult:
    """How a record was flown. Seconds since the switch, metres, degrees; None: does not apply, or did not happen."""

    number: int
    command: str
    reached_s: float | None = None
    #: The distance when the board reported it as reached, and the least one.
    distance_m: float | None = None
    nearest_m: float | None = None
    overshoot_m: float | None = None
    height_m: float | None = None
    planned_height_m: float | None = None
    held_s: float | None = None
    #: The greatest distance while it stayed.
    farthest_m: float | None = None
    turned_deg: float | None = None
    problems: list[str] = field(default_factory=list)


def judge(run: MissionRun, place: Place) -> list[ItemResult]:
    """A result for each record after the home point."""
    results = []
    targets = [_target(record, place) for record in run.records]
    before = (0.0, 0.0)
    for number, record in enumerate(run.records):
        if number:
            target = targets[number]
            after = next(filter(None, targets[number + 1 :]), None)
            results.append(_judge(run, number, record, target, before, after))
            before = target or before
    if results and (problem := _ending(run)):
        results[-1].problems.append(problem)
    return results


@dataclass(frozen=True, slots=True)
class Extremes:
    """Of the true track: m from home, m from the nearest leg of the list, m/s over ground, degrees."""

    farthest_m: float
    off_legs_m: float
    fastest: float
    steepest_deg: float
    has_crashed: bool

    @property
    def problem(self) -> str:
        """What no flight may do, whatever the sensors say, or "" if it did not."""
        if self.has_crashed:
            return "crashed"
        if self.off_legs_m > _FLYAWAY_M or self.fastest > _FASTEST or self.steepest_deg > _STEEPEST_DEG:
            return "out of bounds"
        return ""


def extremes(run: MissionRun, place: Place) -> Extremes:
    corners = [place.position(r.lat_e7 / 1e7, r.lon_e7 / 1e7) if r.lat_e7 else (0.0, 0.0) for r in run.records]
    legs = list(pairwise(corners))
    return Extremes(
        max(sample.distance_to((0.0, 0.0)) for sample in run.track),
        max(min(starmap(sample.distance_to_leg, legs)) for sample in run.track),
        max(sample.speed for sample in run.track),
        max(sample.tilt for sample in run.track),
        run.has_crashed,
    )


def is_flown(results: list[ItemResult]) -> bool:
    return not any(result.problems for result in results)


def _target(record: WpRecord, place: Place) -> tuple[float, float] | None:
    if record.command == WpCommand.RETURN_TO_LAUNCH:
        return 0.0, 0.0
    if record.command not in _MOVING:
        return None
    return place.position(record.lat_e7 / 1e7, record.lon_e7 / 1e7)


def _judge(
    run: MissionRun,
    number: int,
    record: WpRecord,
    target: tuple[float, float] | None,
    before: tuple[float, float],
    after: tuple[float, float] | None,
) -> ItemResult:
    command = WpCommand(record.command)
    result = ItemResult(number, command.name)
    if command is WpCommand.SETROI:
        return result
    result.planned_height_m = None if command is WpCommand.LAND else float(record.height_m)
    reached_s = run.reached_at(number)
    if command is WpCommand.LAND:
        _judge_landing(run, number, result)
        return result
    if reached_s is None:
        result.problems.append("not reached")
        return result
    result.reached_s = reached_s - run.begun_s
    at_arrival = run.track.between(reached_s - 0.15, reached_s + 0.15)
    result.height_m = at_arrival.last.height
    if command is WpCommand.TAKEOFF:
        if result.height_m < record.height_m - _TAKEOFF_M:
            result.problems.append(f"only {result.height_m:.1f} m high")
        return result
    assert target is not None
    flown = run.track.between(run.begun_s, reached_s + _OVERSHOOT_S)
    result.nearest_m = min(sample.distance_to(target) for sample in flown)
    result.distance_m = min(
        sample.distance_to(target) for sample in run.track.between(reached_s - 0.5, reached_s + 0.1)
    )
    if result.distance_m > max(record.radius_m, _LEAST_RADIUS_M) + _PLACE_M:
        result.problems.append(f"{result.distance_m:.1f} m away when it counted as reached")
    if command is not WpCommand.WAYPOINT or record.time:
        flown = run.track.between(reached_s, reached_s + _OVERSHOOT_S)
        result.overshoot_m = _overshoot(flown, target, before, after or target)
        if result.overshoot_m > _OVERSHOOT_M:
            result.problems.append(f"overshoot {result.overshoot_m:.1f} m")
    _judge_stay(run, number, record, target, result)
    return result


def _judge_stay(
    run: MissionRun, number: int, record: WpRecord, target: tuple[float, float], result: ItemResult
) -> None:
    stays = {
        WpCommand.LOITER_TIME: FlightPhase.LOITER,
        WpCommand.LOITER_TURNS: FlightPhase.TURN,
        WpCommand.LOITER_UNLIM: FlightPhase.STAY,
    }
    state = stays.get(WpCommand(record.command))
    if state is None:
        return
    times = run.in_state(number, state)
    if times is None:
        result.problems.append("it did not stay")
        return
    stayed = run.track.between(*times)
    result.held_s = times[1] - times[0]
    if state is FlightPhase.LOITER and abs(result.held_s - record.time) > _SECONDS:
        result.problems.append(f"stayed {result.held_s:.1f} s instead of {record.time} s")
    if state is FlightPhase.TURN:
        result.turned_deg = _turned(run.track.between(times[0] - _REPORT_S, times[1] + 0.5))
        if abs(result.turned_deg - 360 * record.turns) > _TURN_DEG:
            result.problems.append(f"turned {result.turned_deg:.0f} degrees instead of {360 * record.turns}")
    result.height_m = stayed.last.height
    if state is not FlightPhase.TURN and result.held_s > 5 and abs(result.height_m - record.height_m) > _HOLD_HEIGHT_M:
        result.problems.append(f"{result.height_m:.1f} m high instead of {record.height_m} m")
    _, result.farthest_m = stayed.distances(target)
    if result.farthest_m > max(record.radius_m, _LEAST_RADIUS_M) + _HELD_M:
        result.problems.append(f"up to {result.farthest_m:.1f} m away while it stayed")


def _judge_landing(run: MissionRun, number: int, result: ItemResult) -> None:
    if not run.has_landed:
        result.problems.append("not landed")
        return
    result.reached_s = run.track.last.at_s - run.begun_s
    result.height_m = run.track.last.height
    times = run.in_state(number, FlightPhase.DESCENT, FlightPhase.SINK)
    if times:
        begin = run.track.between(times[0] - 0.2, times[0] + 0.2).last
        result.distance_m = run.track.last.distance_to(begin.position[:2])
        if result.distance_m > _LANDED_M:
            result.problems.append(f"landed {result.distance_m:.1f} m from where it began to descend")


def _ending(run: MissionRun) -> str:
    if not run.has_ended:
        return "the flight did not end in time"
    if run.reason not in (FlightReason.NONE, FlightReason.FLOWN, FlightReason.DISARMED):
        return f"the flight was stopped: {run.reason.name.lower().replace('_', ' ')}"
    return ""


def _overshoot(
    flown: Track, target: tuple[float, float], before: tuple[float, float], after: tuple[float, float]
) -> float:
    """The distance flown beyond the place along the leg, less what the next leg adds in that direction."""
    north, west = target[0] - before[0], target[1] - before[1]
    length = hypot(north, west)
    if length < 1.0:
        return 0.0
    beyond = (((s.position[0] - target[0]) * north + (s.position[1] - target[1]) * west) / length for s in flown)
    onward = ((after[0] - target[0]) * north + (after[1] - target[1]) * west) / length
    return max(0.0, max(beyond, default=0.0) - max(0.0, onward))


def _turned(flown: Track) -> float:
    """The sum of all turns of the nose, clockwise, degrees."""
    total, last = 0.0, None
    for sample in flown:
        if last is not None:
            total += (sample.heading - last + 180) % 360 - 180
        last = sample.heading
    return total
