# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle in published groups (reports.vehicle_groups): for zenoh, the status page and the command line."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from math import inf
from typing import Any

from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.missions.mission_service import MissionService
from bridge.model import vehicle as v
from bridge.model.craft import FlightMode
from bridge.model.ground_track import bearing_deg, distance_m
from bridge.model.missions import FlightReport, MissionProgress
from bridge.settings.board_settings import BoardSettings
from bridge.vehicle.readiness import CraftReadiness
from protocols.msp.telemetry import Sensor
from reports.vehicle_groups import (
    Attitude,
    Battery,
    Gps,
    Group,
    LastHeard,
    Link,
    MissionIdentity,
    Position,
    Rc,
    SettingsIdentity,
    Status,
    VehicleReport,
)

#: The readings of each group, and their poll intervals while the group is watched, seconds. A group is published when
#: the first reading arrives; when another does, unless it was published just before, and when one becomes stale.
_SHOWS: Mapping[Group, Mapping[type[v.Reading], float]] = {
    Group.ATTITUDE: {v.Orientation: 0.1},
    Group.POSITION: {v.GlobalPosition: 0.2, v.Height: 0.2},
    Group.GPS: {v.GpsFix: 0.2},
    Group.BATTERY: {v.Power: 1.0, v.Charge: 1.0},
    Group.RC: {v.Sticks: 0.5, v.Signal: 1.0},
    Group.STATUS: {v.FlightState: 0.25, v.Mode: 0.25, v.Health: 0.25},
    Group.LINK: {},
}
#: By reading: its group, and how long ago the group was last published, seconds, for the reading to publish it again.
_NEWS_OF: Mapping[type[v.Reading], tuple[Group, float]] = {
    reading: (group, 0.0 if number == 0 else 1.5 * next(iter(readings.values())))
    for group, readings in _SHOWS.items()
    for number, reading in enumerate(readings)
}
#: A reading is fresh up to and including the last moment.
_SOON_S = 1e-3
_FIXES = {v.Fix.NO_FIX: "none", v.Fix.TWO_D: "2D", v.Fix.THREE_D: "3D"}


@dataclass(eq=False)
class VehicleReporter:
    """Makes groups on request. `_want` sets the poll interval of each reading, seconds."""

    _session: FcSession
    _missions: MissionService
    _ground: Ground
    _settings: BoardSettings
    _readiness: CraftReadiness
    _want: Callable[[Mapping[type[v.Reading], float]], None]
    _progress: MissionProgress
    #: The groups in use: they are polled, and those updated published.
    watched: frozenset[Group] = frozenset()
    #: Those updated.
    fresh: set[Group] = field(default_factory=set)
    _published_at: dict[Group, float] = field(default_factory=dict)
    #: The readings that were fresh, and when the first of them becomes stale.
    _current: set[type[v.Reading]] = field(default_factory=set)
    due: float = inf

    def __post_init__(self) -> None:
        self._makers: Mapping[Group, Callable[[float], Any]] = {
            Group.ATTITUDE: self._attitude,
            Group.POSITION: self._position,
            Group.GPS: self._gps,
            Group.BATTERY: self._battery,
            Group.RC: self._rc,
            Group.STATUS: self._status,
            Group.LINK: self._link,
        }

    def heard(self, news: Collection[type[v.Reading]], now: float) -> None:
        """Note new readings. To be called while groups are watched."""
        for reading in news:
            group, pause_s = _NEWS_OF.get(reading, (Group.LINK, inf))
            if group in self.watched and now >= self._published_at.get(group, -inf) + pause_s:
                self.fresh.add(group)
                self._published_at[group] = now
        self._current.update(news)
        if self.due == inf:
            self.tick(now)

    def tick(self, now: float) -> None:
        """Publish the groups of readings that have become stale."""
        before, fresh = self._current, self._session.vehicle.fresh
        readings = {kind: fresh(kind, now) for kind, (group, _) in _NEWS_OF.items() if group in self.watched}
        self._current = {kind for kind, reading in readings.items() if reading is not None}
        self.fresh.update(_NEWS_OF[kind][0] for kind in before - self._current if kind in readings)
        stale_s = self._session.vehicle.stale_s
        ages = (reading.heard_at + stale_s.get(kind, v.STALE_S) for kind, reading in readings.items() if reading)
        due = min(ages, default=inf)
        # A little later: it is fresh until then. One that is heard meanwhile is fresh for STALE_S at least.
        self.due = due if due == inf else min(due, now + v.STALE_S) + _SOON_S

    def watch(self, groups: Iterable[Group]) -> None:
        self.watched = frozenset(groups)
        self.fresh &= self.watched
        wanted: dict[type[v.Reading], float] = {}
        for group in self.watched:
            wanted |= _SHOWS[group]
        self._want(wanted)

    def group(self, group: Group, now: float) -> Any:
        """The current values of a group: an instance of the class in reports.vehicle_groups."""
        self._session.settle_telemetry()
        return self._makers[group](now)

    def whole(self, now: float) -> VehicleReport:
        held = self._missions.on_board
        mission = None
        if held is not None:
            state, item, why = None, None, None
            if (leg := self._fresh(v.MissionLeg, now)) is not None:
                why = report.why.text if isinstance(report := leg.report, FlightReport) and report.why else None
                state, item = self._progress.progress.text, self._missions.seq_of(self._progress.number) or None
            mission = MissionIdentity(held.identity.count, f"{held.identity.checksum:08x}", state, item, why)
        settings = None
        if (sealed := self._settings.known.state) is not None:
            settings = SettingsIdentity(sealed.seal, None if sealed.change is None else sealed.change.text)
        groups = {group.value: self.group(group, now) for group in Group}
        return VehicleReport(**groups, last_heard=self._last_heard(now), mission=mission, settings=settings)

    def _fresh(self, kind: type[v.ReadingT], now: float) -> v.ReadingT | None:
        return self._session.vehicle.fresh(kind, now)

    def _age_s(self, group: Group, now: float) -> float | None:
        """As in reports.vehicle_groups.Age."""
        vehicle = self._session.vehicle
        fresh = [reading.heard_at for kind in _SHOWS[group] if (reading := vehicle.fresh(kind, now)) is not None]
        if fresh:
            return _age_s(min(fresh), now)
        heard = [reading.heard_at for kind in _SHOWS[group] if (reading := vehicle.last(kind)) is not None]
        return _age_s(max(heard), now) if heard else None

    def _last_heard(self, now: float) -> LastHeard:
        vehicle = self._session.vehicle
        state, mode, place = vehicle.last(v.FlightState), vehicle.last(v.Mode), vehicle.last(v.GlobalPosition)
        return LastHeard(
            armed=None if state is None else state.armed,
            armed_age_s=None if state is None else _age_s(state.heard_at, now),
            mode=_mode_name(mode),
            mode_age_s=None if mode is None else _age_s(mode.heard_at, now),
            lat_deg=None if place is None else place.lat_e7 / 1e7,
            lon_deg=None if place is None else place.lon_e7 / 1e7,
            place_age_s=None if place is None else _age_s(place.heard_at, now),
        )

    def _attitude(self, now: float) -> Attitude:
        attitude, age_s = self._fresh(v.Orientation, now), self._age_s(Group.ATTITUDE, now)
        if attitude is None:
            return Attitude(age_s=age_s)
        heading_deg = _direction(attitude.heading_deg) if attitude.is_north_known else None
        return Attitude(_rounded(attitude.roll_deg), _rounded(attitude.pitch_deg), heading_deg, age_s)

    def _position(self, now: float) -> Position:
        home = self._session.vehicle.home
        here, height = self._fresh(v.GlobalPosition, now), self._fresh(v.Height, now)
        return Position(
            lat_deg=None if here is None else here.lat_e7 / 1e7,
            lon_deg=None if here is None else here.lon_e7 / 1e7,
            altitude_m=None if here is None else here.altitude_m,
            height_m=None if height is None else _rounded(height.height_m),
            climb_m_s=None if height is None else _rounded(height.climb_m_s),
            north_m_s=None if here is None else _rounded(here.north_m_s),
            east_m_s=None if here is None else _rounded(here.east_m_s),
            home_lat_deg=None if home is None else home.lat_e7 / 1e7,
            home_lon_deg=None if home is None else home.lon_e7 / 1e7,
            home_distance_m=None if home is None or here is None else round(distance_m(here, home), 1),
            home_direction_deg=None if home is None or here is None else _direction(bearing_deg(here, home)),
            age_s=self._age_s(Group.POSITION, now),
        )

    def _gps(self, now: float) -> Gps:
        gps, age_s = self._fresh(v.GpsFix, now), self._age_s(Group.GPS, now)
        if gps is None:
            return Gps(age_s=age_s)
        return Gps(_FIXES[gps.fix], gps.satellites, gps.hdop, gps.ground_speed_m_s, _direction(gps.course_deg), age_s)

    def _battery(self, now: float) -> Battery:
        power, charge = self._fresh(v.Power, now), self._fresh(v.Charge, now)
        return Battery(
            voltage_v=None if power is None else power.voltage_v,
            current_a=None if power is None else power.current_a,
            drawn_mah=None if charge is None else charge.drawn_mah,
            cells=None if power is None else power.cells,
            remaining_percent=None if power is None else power.remaining_percent,
            age_s=self._age_s(Group.BATTERY, now),
        )

    def _rc(self, now: float) -> Rc:
        sticks, signal = self._fresh(v.Sticks, now), self._fresh(v.Signal, now)
        return Rc(
            channels_us=None if sticks is None else sticks.channels_us,
            rssi_percent=None if signal is None else round(signal.strength * 100, 1),
            age_s=self._age_s(Group.RC, now),
        )

    def _status(self, now: float) -> Status:
        state, mode, health = self._fresh(v.FlightState, now), self._fresh(v.Mode, now), self._fresh(v.Health, now)
        return Status(
            armed=None if state is None else state.armed,
            mode=_mode_name(mode),
            sensors=None if health is None else _names(health.sensors),
            cycle_time_us=None if health is None else health.cycle_time_us,
            i2c_errors=None if health is None else health.i2c_errors,
            readiness=self._readiness.state.title,
            not_ready_why=self._readiness.reasons,
            age_s=self._age_s(Group.STATUS, now),
        )

    def _link(self, _now: float) -> Link:
        state = self._session.state
        controller, msp = state.controller, state.link
        return Link(
            state=state.name,
            flight_controller=None if controller is None else controller.name,
            speed_baud=None if controller is None else state.speed,
            round_trip_ms=None if msp is None else round(msp.round_trip_s * 1000, 1),
            requests_lost=None if msp is None else msp.requests_lost,
            bad_checksums=state.bad_checksums,
            ground_stations=tuple(str(peer) for peer in self._ground.peers()),
        )


def _age_s(heard_at: float, now: float) -> float:
    return max(round(now - heard_at, 1), 0.0)


def _mode_name(mode: v.Mode | None) -> str | None:
    if mode is None:
        return None
    return mode.mode.name if isinstance(mode.mode, FlightMode) else mode.mode


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


def _direction(value: float | None) -> float | None:
    """From 0 to below 360, even after rounding."""
    return None if value is None else round(value, 2) % 360


@cache
def _names(sensors: Sensor) -> tuple[str, ...]:
    return tuple(str(sensor.name).lower() for sensor in Sensor if sensor & sensors)
