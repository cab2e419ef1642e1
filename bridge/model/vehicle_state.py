# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of the vehicle now, from MSP telemetry. None means "unknown", never 0."""

from dataclasses import dataclass, field
from enum import IntEnum

from bridge.fc.profile import FlightController
from bridge.model.flight_mode import FlightMode, flight_mode
from bridge.model.ground_track import GroundTrack, Velocity
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame
from protocols.msp.nav import NavStatus, decode_nav_status
from protocols.msp.telemetry import (
    Altitude,
    Analog,
    Attitude,
    HomePoint,
    HomeVector,
    RawGps,
    RawImu,
    Sensor,
    StatusReport,
    decode_altitude,
    decode_analog,
    decode_attitude,
    decode_channels,
    decode_comp_gps,
    decode_home,
    decode_raw_gps,
    decode_raw_imu,
    decode_status,
)

_INAV = "INAV"


class Fix(IntEnum):
    """MAVLink's GPS_FIX_TYPE."""

    NO_FIX = 1
    TWO_D = 2
    THREE_D = 3


@dataclass(slots=True)
class VehicleState:
    """The latest of everything. When it was heard is not kept: a lost link clears the state as a whole."""

    mixer: int | None = None
    armed: bool | None = None
    mode: FlightMode | None = None
    status: StatusReport | None = None
    #: Whether the heading is one: without a compass a Harakiri's stays 0.
    has_compass: bool = False
    attitude: Attitude | None = None
    gps: RawGps | None = None
    fix: Fix = Fix.NO_FIX
    velocity: Velocity | None = None
    altitude: Altitude | None = None
    analog: Analog | None = None
    channels: tuple[int, ...] | None = None
    imu: RawImu | None = None
    home: HomePoint | None = None
    home_vector: HomeVector | None = None
    nav: NavStatus | None = None
    #: A receiver that was never heard to have any strength is not measured.
    measures_rssi: bool = False
    _track: GroundTrack = field(default_factory=GroundTrack)

    def take(self, frame: MspFrame, controller: FlightController) -> None:
        """Learn from one reply; replies that are errors or too short teach nothing."""
        if frame.direction is not Direction.REPLY:
            return
        payload = frame.payload
        match frame.command:
            case Msp.ATTITUDE:
                self.attitude = decode_attitude(payload) or self.attitude
            case Msp.RAW_GPS:
                self._take_gps(payload, controller)
            case Msp.ALTITUDE:
                self.altitude = decode_altitude(payload) or self.altitude
            case Msp.STATUS:
                self._take_status(payload, controller)
            case Msp.RC:
                self.channels = decode_channels(payload) or self.channels
            case Msp.ANALOG:
                self.analog = decode_analog(payload) or self.analog
                self.measures_rssi |= self.analog is not None and self.analog.rssi > 0
            case Msp.RAW_IMU:
                self.imu = decode_raw_imu(payload) or self.imu
            case Msp.COMP_GPS:
                self.home_vector = decode_comp_gps(payload) or self.home_vector
            case Msp.NAV_STATUS:
                self.nav = decode_nav_status(payload) or self.nav
            case Msp.WP:
                home = decode_home(payload)
                if home is not None:
                    self.home = home if home.lat_e7 and home.lon_e7 else None

    @property
    def has_fix(self) -> bool:
        """Whether the position is one."""
        return self.fix is not Fix.NO_FIX

    @property
    def height(self) -> Altitude | None:
        """Height and climb, if anything measures them: a board without a barometer answers zeros."""
        altitude, status = self.altitude, self.status
        if altitude is None or status is None:
            return None
        measured = status.sensors & Sensor.BAROMETER or altitude.height_cm or altitude.climb_cms
        return altitude if measured else None

    def home_or_position(self) -> tuple[int, int] | None:
        """Return the flight controller's home, else where it stands with a fix: degrees * 1e7."""
        if self.home is not None:
            return self.home.lat_e7, self.home.lon_e7
        if self.gps is not None and self.has_fix:
            return self.gps.lat_e7, self.gps.lon_e7
        return None

    @property
    def home_altitude_m(self) -> float | None:
        """How high home lies above the sea: where it stands, or in flight so much lower than it flies."""
        if self.gps is None or not self.has_fix:
            return None
        if self.armed is False:
            return self.gps.altitude_m
        return None if self.height is None else self.gps.altitude_m - self.height.height_cm / 100

    def _take_status(self, payload: bytes, controller: FlightController) -> None:
        status = decode_status(payload)
        if status is None:
            return
        self.status = status
        self.has_compass = bool(status.sensors & Sensor.COMPASS)
        arm_bit = controller.arm_bit
        if arm_bit is not None:
            self.armed = bool(status.box_flags >> arm_bit & 1)
        if controller.boxes:
            self.mode = flight_mode(status.box_flags, controller.boxes)

    def _take_gps(self, payload: bytes, controller: FlightController) -> None:
        gps = decode_raw_gps(payload)
        if gps is None:
            return
        self.gps = gps
        if not gps.fix:
            self.fix = Fix.NO_FIX
        elif controller.name == _INAV:
            self.fix = Fix.TWO_D if gps.fix == 1 else Fix.THREE_D
        else:
            self.fix = Fix.THREE_D
        self.velocity = self._track.velocity(gps) if self.has_fix else None
