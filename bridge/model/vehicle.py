# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicle: everything known about it, whichever protocol the flight controller speaks at the moment.

Decoders fill it (bridge/fc), and everything shown anywhere is made from it: MAVLink messages, zenoh, the status page,
metrics. Units are SI, angles are in degrees. None means unknown. Values that arrive together are one reading with its
arrival time, and `Vehicle.fresh` says whether it is current. A lost link does not clear values.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import Protocol, TypeVar

from bridge.model.craft import LEAST_V, Airframe, FlightMemory, FlightMode, Home, least_cells, remaining_percent
from bridge.model.ground_track import GroundTrack, distance_m
from bridge.model.missions import FlightReport
from protocols.mission_item import is_on_earth
from protocols.msp.nav import NavStatus
from protocols.msp.telemetry import Sensor

#: A reading older than this is stale: shown as such, or not at all. With the transmission time this makes 1.5 s.
STALE_S = 1.4
#: Before the first arming, home follows the craft's position. Smaller moves than this are the receiver's noise.
_STANDING_M = 10.0
#: A message is never delivered later than this.
_LATE_S = 5.0
#: After a longer silence on the ground the battery may be another.
_SWAP_S = 10.0
#: 2020: no GPS reports an earlier time.
_EARLIEST_UNIX_S = 1_577_836_800


class Source(Enum):
    """The protocol of a reading."""

    MSP = "MSP"
    MAVLINK = "MAVLink"


class Fix(IntEnum):
    """MAVLink's GPS_FIX_TYPE."""

    NO_FIX = 1
    TWO_D = 2
    THREE_D = 3


@dataclass(slots=True)  # not frozen, as in protocols.mavlink.frame
class Reading:
    """Values that arrive together. heard_at: monotonic seconds."""

    heard_at: float
    source: Source


@dataclass(slots=True)
class Orientation(Reading):
    """Right wing down and nose up are positive; heading 0 up to 360.

    is_north_known: False if the heading does not come from a compass (Harakiri then reports 0).
    """

    roll_deg: float
    pitch_deg: float
    heading_deg: float
    is_north_known: bool = True


@dataclass(slots=True)
class GpsFix(Reading):
    """The GPS receiver's report. The course is the receiver's own, or follows from successive positions."""

    fix: Fix
    satellites: int | None
    ground_speed_m_s: float | None = None
    course_deg: float | None = None
    hdop: float | None = None


@dataclass(slots=True)
class GlobalPosition(Reading):
    """Heard only while there is a fix. Degrees * 1e7, metres above mean sea level, m/s."""

    lat_e7: int
    lon_e7: int
    altitude_m: float | None
    north_m_s: float | None = None
    east_m_s: float | None = None


@dataclass(slots=True)
class Height(Reading):
    """Height above the launch point and climb rate, as the flight controller estimates them."""

    height_m: float
    climb_m_s: float


@dataclass(slots=True)
class Power(Reading):
    """The battery. A flight controller without a sensor reports 0 V, which is unknown here.

    cells, remaining_percent: from flight controllers that know them; Vehicle estimates them for the others.
    """

    voltage_v: float | None
    current_a: float | None = None
    cells: int | None = None
    remaining_percent: int | None = None


@dataclass(slots=True)
class Charge(Reading):
    """Taken from the battery. MAVLink sends it separately from the voltage."""

    drawn_mah: int


@dataclass(slots=True)
class Sticks(Reading):
    """RC pulse widths in MAVLink's order: roll, pitch, throttle, yaw, aux 1.."""

    channels_us: tuple[int, ...]


@dataclass(slots=True)
class Switches(Reading):
    """The aux channel positions that turn on each box, from MSP_BOX. `boxes`: their names."""

    boxes: tuple[str, ...]
    activation: tuple[int, ...]


@dataclass(slots=True)
class Signal(Reading):
    """The RC receiver's signal strength, 0..1."""

    strength: float


@dataclass(slots=True)
class FlightState(Reading):
    """armed: None if the flight controller does not report it.

    is_failsafe: True if it is armed and has taken over from the pilot, as far as it reports that.
    """

    armed: bool | None
    is_failsafe: bool = False


@dataclass(slots=True)
class Mode(Reading):
    """A FlightMode, or another autopilot's mode number. If made from several messages, heard_at is the oldest's."""

    mode: FlightMode | str


@dataclass(slots=True)
class Health(Reading):
    """The flight controller itself. sensors: fitted and answering. i2c_errors: sensor reads that failed since boot."""

    sensors: Sensor
    cycle_time_us: int | None = None
    i2c_errors: int | None = None


@dataclass(slots=True)
class Load(Reading):
    """The flight controller's CPU load, 0..1."""

    cpu_load: float


@dataclass(slots=True)
class Readiness(Reading):
    """The reasons that prevent arming, as text; () if there are none. Unknown on firmware that does not report them."""

    blockers: tuple[str, ...]


@dataclass(slots=True)
class Airspeed(Reading):
    """The airspeed, from flight controllers with a pitot tube."""

    airspeed_m_s: float


@dataclass(slots=True)
class MissionLeg(Reading):
    """Progress through the mission, from flight controllers that report it."""

    report: NavStatus | FlightReport


@dataclass(slots=True)
class GpsTime(Reading):
    """UTC by the flight controller's GPS, seconds since 1970."""

    unix_s: float


ReadingT = TypeVar("ReadingT", bound=Reading)


class _Last(Protocol):
    def __call__(self, kind: type[ReadingT], /) -> ReadingT | None: ...


class Vehicle:
    """The latest reading of each kind, and home.

    >>> vehicle.hear(Height(100.0, Source.MSP, height_m=12.0, climb_m_s=0.5))
    >>> vehicle.fresh(Height, now=101.0).height_m, vehicle.fresh(Height, now=102.0)
    (12.0, None)
    """

    def __init__(self) -> None:
        self._readings: dict[type[Reading], Reading] = {}
        #: By a ground station's clock: when the monotonic clock was 0, seconds since 1970.
        self.station_epoch_s: float | None = None
        #: The latest reading of a kind, however old: `last(Height)`.
        self.last: _Last = self._readings.get  # type: ignore[assignment]
        self.forget()

    def forget(self) -> None:
        """Begin again with a different board."""
        self.airframe = Airframe.QUADROTOR
        #: The firmware version: major, minor, patch level.
        self.version: tuple[int, int, int] | None = None
        self.home: Home | None = None
        #: The ages at which readings become stale, if not STALE_S: the line may be too slow to poll them so often.
        self.stale_s: Mapping[type[Reading], float] = {}
        #: When any reading was last heard.
        self.heard_at: float | None = None
        self.track = GroundTrack()
        self._readings.clear()
        #: The kinds of readings heard. Their reader replaces the set.
        self.news: set[type[Reading]] = set()
        self._cells = 1
        #: False before the first arming, while home is only the place of the craft.
        self.is_home_settled = False
        #: As last heard, however long ago.
        self.armed: bool | None = None
        #: When it was armed, or first heard armed, or None unless armed.
        self.armed_at: float | None = None
        #: True from `resume` until the craft is heard.
        self._is_resumed = False

    def memory(self, family: str, now: float) -> FlightMemory | None:
        """The facts about an armed craft that a restarted bridge needs, or None unless it is armed."""
        switches = self.last(Switches)
        if self.last(FlightState) is None or self.armed_at is None:
            return None
        ranges = ((), ()) if switches is None else (switches.boxes, switches.activation)
        home = self.home if self.is_home_settled else None
        return FlightMemory(
            family, self.armed_at, now, self.flight_mode, home, *ranges, self.airframe, self.version, self._cells
        )

    def resume(self, memory: FlightMemory) -> None:
        """Continue a flight that a previous bridge has seen. Readings that contradict it undo this."""
        self.airframe, self.version, self._cells = memory.airframe, memory.version, memory.cells
        self.home, self.is_home_settled = memory.home, memory.home is not None
        self.armed_at, self._is_resumed = memory.armed_at, True
        self._readings[FlightState] = FlightState(memory.made_at, Source.MSP, True)
        self.armed = True
        if memory.mode is not None:
            self._readings[Mode] = Mode(memory.made_at, Source.MSP, memory.mode)
        if memory.boxes:
            self._readings[Switches] = Switches(memory.made_at, Source.MSP, memory.boxes, memory.activation)

    def hear_uptime(self, now: float, uptime_s: float) -> None:
        """Take the flight controller's time since the start: if it started after the arming, that flight is over."""
        if self.armed_at is not None and now - uptime_s > self.armed_at + _LATE_S:
            self._end_flight()

    def _end_flight(self) -> None:
        """Forget the values from an earlier flight."""
        self.home, self.is_home_settled, self.armed_at = None, False, None
        self.armed, self._is_resumed = None, False
        for kind in (Switches, FlightState, Mode):
            self._readings.pop(kind, None)

    @property
    def flight_mode(self) -> FlightMode | None:
        """The flight mode as last heard, however long ago, or None for another autopilot's."""
        last = self.last(Mode)
        return last.mode if last is not None and isinstance(last.mode, FlightMode) else None

    def hear(self, reading: Reading) -> None:
        """Store a reading in place of the previous one of the kind. An impossible position is ignored."""
        kind = type(reading)
        if isinstance(reading, GlobalPosition) and not _is_place(reading.lat_e7, reading.lon_e7):
            return
        if isinstance(reading, FlightState) and reading.armed is not None:
            self._follow_arming(reading.armed, reading.heard_at)
        if isinstance(reading, Power):
            reading = self._estimated(reading)
        if kind is Mode and MissionLeg in self._readings and self.mission_flight(reading.heard_at) is not None:
            # The boxes that are active meanwhile are those of the functions that the flight uses.
            reading = Mode(reading.heard_at, reading.source, FlightMode.AUTO)
        self._readings[kind] = reading
        self.news.add(kind)
        if self.heard_at is None or reading.heard_at > self.heard_at:
            self.heard_at = reading.heard_at
        if isinstance(reading, FlightState):
            was_armed, self.armed = self.armed, reading.armed
            self._place_home(has_armed=was_armed is False and reading.armed is True)
        elif kind is GlobalPosition or kind is Height:
            self._place_home(has_armed=False)

    def _follow_arming(self, armed: bool, now: float) -> None:
        if self._is_resumed and not armed:
            self._end_flight()
        self._is_resumed = False
        if not armed:
            self.armed_at = None
        elif self.armed_at is None:
            self.armed_at = now

    def _estimated(self, power: Power) -> Power:
        """Fill in cells and remaining charge if the flight controller does not report them."""
        if power.voltage_v is None or power.voltage_v < LEAST_V or power.remaining_percent is not None:
            return power
        before = self.last(Power)
        if before is not None and power.heard_at > before.heard_at + _SWAP_S and not self.armed:
            self._cells = 1
        # Never fewer than before: a discharging battery does not lose cells.
        self._cells = max(self._cells, power.cells or least_cells(power.voltage_v))
        return replace(power, cells=self._cells, remaining_percent=remaining_percent(power.voltage_v, self._cells))

    def hear_home(self, lat_e7: int, lon_e7: int, altitude_m: float | None = None) -> None:
        """Take the flight controller's own home, degrees * 1e7. It has none while these are 0 or 190 degrees."""
        if not _is_place(lat_e7, lon_e7):
            return
        self.is_home_settled = True
        if self.home is None or (self.home.lat_e7, self.home.lon_e7) != (lat_e7, lon_e7):
            self.home = Home(lat_e7, lon_e7, None if self.home is None else self.home.altitude_m)
            self._place_home(has_armed=False)
        if altitude_m is not None:
            self.home = replace(self.home, altitude_m=altitude_m)

    def hear_gps_time(self, now: float, source: Source, unix_s: float) -> None:
        """Take UTC by GPS, seconds since 1970. Without it an autopilot counts from the start, and INAV reports 0."""
        if unix_s > _EARLIEST_UNIX_S:
            self.hear(GpsTime(now, source, unix_s))

    def hear_station_time(self, unix_s: float, now: float) -> None:
        if unix_s > _EARLIEST_UNIX_S:
            self.station_epoch_s = unix_s - now

    def fresh(self, kind: type[ReadingT], now: float, stale_s: float | None = None) -> ReadingT | None:
        reading = self.last(kind)
        limit_s = self.stale_s.get(kind, STALE_S) if stale_s is None else stale_s
        return reading if reading is not None and now <= reading.heard_at + limit_s else None

    @property
    def last_report(self) -> FlightReport | None:
        """The last report of a board that reports more on the mission than the record (Harakiri)."""
        leg = self.last(MissionLeg)
        return leg.report if leg is not None and isinstance(leg.report, FlightReport) else None

    def mission_flight(self, now: float) -> FlightReport | None:
        """The same of a board that flies the mission now."""
        flight = None if self.fresh(MissionLeg, now) is None else self.last_report
        return flight if flight is not None and flight.is_flown else None

    def home_or_position(self) -> Home | None:
        """Home. Before it is known, the current position, at the altitude of the launch."""
        position, height = self.last(GlobalPosition), self.last(Height)
        if self.home is not None or position is None:
            return self.home
        altitude_m = position.altitude_m
        if self.armed and height is not None and altitude_m is not None:
            altitude_m -= height.height_m
        return Home(position.lat_e7, position.lon_e7, altitude_m)

    def place(self) -> tuple[int, int] | None:
        """Latitude and longitude of `home_or_position`, degrees * 1e7."""
        here = self.home_or_position()
        return None if here is None else (here.lat_e7, here.lon_e7)

    def _place_home(self, *, has_armed: bool) -> None:
        """Home is where the craft was armed. It never moves in flight, even if the link is lost.

        Before the first arming it is the place of the craft. The flight controller's own home overrides both.
        """
        position, height = self.last(GlobalPosition), self.last(Height)
        if position is None:
            return
        here = Home(position.lat_e7, position.lon_e7, position.altitude_m)
        if has_armed:
            self.home, self.is_home_settled = here, True
        elif self.armed is False and not self.is_home_settled:
            if self.home is None or distance_m(self.home, here) > _STANDING_M:
                self.home = here
        elif self.home is not None and self.home.altitude_m is None:
            if self.armed is False:
                self.home = replace(self.home, altitude_m=position.altitude_m)
            elif self.armed and height is not None and position.altitude_m is not None:
                self.home = replace(self.home, altitude_m=position.altitude_m - height.height_m)


def _is_place(lat_e7: int, lon_e7: int) -> bool:
    """False for 0/0 and beyond the poles, which a board without a real fix may report."""
    return bool(lat_e7 and lon_e7) and is_on_earth(lat_e7, lon_e7)
