# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle in published groups (bridge.model.vehicle_groups): for zenoh, the status page and the command line."""

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from typing import Any

from bridge.fc.session import FcSession
from bridge.gcs.ground import Ground
from bridge.missions.mission_service import MissionService
from bridge.model.flight_mode import FlightMode
from bridge.model.ground_track import bearing_deg, distance_m
from bridge.model.vehicle import (
    Fix,
    FlightState,
    GlobalPosition,
    GpsFix,
    Health,
    Height,
    Orientation,
    Power,
    Reading,
    ReadingT,
    Signal,
    Sticks,
)
from bridge.model.vehicle_groups import (
    Attitude,
    Battery,
    Gps,
    Group,
    Link,
    MissionIdentity,
    Position,
    Rc,
    SettingsIdentity,
    Status,
    VehicleReport,
)
from bridge.vehicle.settings_seal import SettingsSeal
from protocols.msp.telemetry import Sensor

#: The readings of each group, and their poll intervals while the group is watched, seconds. A group is published when
#: its first reading arrives.
_SHOWS: Mapping[Group, Mapping[type[Reading], float]] = {
    Group.ATTITUDE: {Orientation: 0.1},
    Group.POSITION: {GlobalPosition: 0.2, Height: 0.2},
    Group.GPS: {GpsFix: 0.2},
    Group.BATTERY: {Power: 1.0},
    Group.RC: {Sticks: 0.5},
    Group.STATUS: {FlightState: 0.25},
    Group.LINK: {},
}
_NEWS_OF = {next(iter(readings)): group for group, readings in _SHOWS.items() if readings}
_FIXES = {Fix.NO_FIX: "none", Fix.TWO_D: "2D", Fix.THREE_D: "3D"}


class VehicleReporter:
    """Makes groups on request. `want` sets the poll interval of each reading, seconds."""

    def __init__(
        self,
        session: FcSession,
        missions: MissionService,
        ground: Ground,
        settings: SettingsSeal,
        want: Callable[[Mapping[type[Reading], float]], None],
    ) -> None:
        self._session = session
        self._missions = missions
        self._ground = ground
        self._settings = settings
        self._want = want
        #: Groups updated since the last `take_fresh`; some may no longer be watched.
        self.fresh: set[Group] = set()
        #: The groups in use: they are polled, and `take_fresh` returns the updated ones.
        self.watched: frozenset[Group] = frozenset()
        self._makers: Mapping[Group, Callable[[float], Any]] = {
            group: getattr(self, f"_{group.value}") for group in Group
        }

    def heard(self, news: Collection[type[Reading]]) -> None:
        """The vehicle has new readings. To be called while groups are watched."""
        self.fresh.update(group for reading, group in _NEWS_OF.items() if reading in news)

    def watch(self, groups: Iterable[Group]) -> None:
        """Poll for these groups from now on; `take_fresh` returns the updated ones."""
        self.watched = frozenset(groups)
        wanted: dict[type[Reading], float] = {}
        for group in self.watched:
            wanted |= _SHOWS[group]
        self._want(wanted)

    def take_fresh(self) -> frozenset[Group]:
        """The watched groups updated since the last call."""
        fresh = self.watched & self.fresh
        self.fresh.clear()
        return fresh

    def group(self, group: Group, now: float) -> Any:
        """The current values of a group: an instance of its class in bridge.model.vehicle_groups."""
        self._session.settle_telemetry()
        return self._makers[group](now)

    def whole(self, now: float) -> VehicleReport:
        held = self._missions.held
        mission = None if held is None else MissionIdentity(held.identity.count, f"{held.identity.checksum:08x}")
        settings = None
        if (sealed := self._settings.state) is not None:
            settings = SettingsIdentity(str(sealed.seal), None if sealed.change is None else sealed.change.text())
        groups = {group.value: self.group(group, now) for group in Group}
        return VehicleReport(**groups, mission=mission, settings=settings)

    def _last(self, kind: type[ReadingT]) -> ReadingT | None:
        return self._session.vehicle.last(kind)

    def _attitude(self, now: float) -> Attitude:
        attitude = self._last(Orientation)
        if attitude is None:
            return Attitude()
        heading_deg = _direction(attitude.heading_deg) if attitude.is_north_known else None
        return Attitude(_rounded(attitude.roll_deg), _rounded(attitude.pitch_deg), heading_deg, _age_s(attitude, now))

    def _position(self, now: float) -> Position:
        home, here, height = self._session.vehicle.home, self._last(GlobalPosition), self._last(Height)
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
            age_s=_age_s(here or height, now),
        )

    def _gps(self, now: float) -> Gps:
        gps = self._last(GpsFix)
        if gps is None:
            return Gps()
        course_deg = _direction(gps.course_deg)
        return Gps(_FIXES[gps.fix], gps.satellites, gps.hdop, gps.ground_speed_m_s, course_deg, _age_s(gps, now))

    def _battery(self, now: float) -> Battery:
        power = self._last(Power)
        if power is None:
            return Battery()
        more = power.cells, power.remaining_percent, _age_s(power, now)
        return Battery(power.voltage_v, power.current_a, power.drawn_mah, *more)

    def _rc(self, now: float) -> Rc:
        sticks, signal = self._last(Sticks), self._last(Signal)
        if sticks is None:
            return Rc()
        return Rc(sticks.channels_us, None if signal is None else round(signal.strength * 100, 1), _age_s(sticks, now))

    def _status(self, now: float) -> Status:
        state, health = self._last(FlightState), self._last(Health)
        mode = None if state is None else state.mode
        return Status(
            armed=None if state is None else state.armed,
            mode=mode.name if isinstance(mode, FlightMode) else mode,
            sensors=None if health is None else _names(health.sensors),
            cycle_time_us=None if health is None else health.cycle_time_us,
            i2c_errors=None if health is None else health.i2c_errors,
            age_s=_age_s(state, now),
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


def _age_s(reading: Reading | None, now: float) -> float | None:
    return None if reading is None else max(round(now - reading.heard_at, 1), 0.0)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


def _direction(value: float | None) -> float | None:
    """0 up to 360, also after rounding."""
    return None if value is None else round(value, 2) % 360


@cache
def _names(sensors: Sensor) -> tuple[str, ...]:
    return tuple(str(sensor.name).lower() for sensor in Sensor if sensor & sensors)
