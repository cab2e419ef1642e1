"""What is known of the vehicle now, from MSP telemetry. None means "unknown", never 0."""

from dataclasses import dataclass

from bridge.flight_controller import FlightController
from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, request
from protocols.msp.telemetry import (
    Altitude,
    Analog,
    Attitude,
    HomePoint,
    RawGps,
    decode_altitude,
    decode_analog,
    decode_attitude,
    decode_home,
    decode_raw_gps,
    decode_status,
)


@dataclass(frozen=True, slots=True)
class Poll:
    """One telemetry question: its frame, the size of the reply's payload, and how often it is asked."""

    command: Msp
    frame: bytes
    reply_payload: int
    interval_s: float


#: STATUS comes most often: arming must be noticed while a mission transfer runs.
POLLS = (
    Poll(Msp.STATUS, request(Msp.STATUS), 11, 0.25),
    Poll(Msp.ATTITUDE, request(Msp.ATTITUDE), 8, 1.0),
    Poll(Msp.RAW_GPS, request(Msp.RAW_GPS), 18, 1.0),
    Poll(Msp.ALTITUDE, request(Msp.ALTITUDE), 10, 1.0),
    Poll(Msp.ANALOG, request(Msp.ANALOG), 7, 1.0),
    Poll(Msp.WP, request(Msp.WP, b"\0"), 21, 5.0),
)


@dataclass(slots=True)
class VehicleState:
    """The latest of everything. `gps_at` and the like are not kept: a lost link clears the state as a whole."""

    mixer: int | None = None
    armed: bool | None = None
    attitude: Attitude | None = None
    gps: RawGps | None = None
    altitude: Altitude | None = None
    analog: Analog | None = None
    home: HomePoint | None = None

    def take(self, frame: MspFrame, controller: FlightController) -> None:
        """Learn from one reply; replies that are errors or too short teach nothing."""
        if frame.direction is not Direction.REPLY:
            return
        payload = frame.payload
        match frame.command:
            case Msp.STATUS:
                status = decode_status(payload)
                if status is not None and controller.arm_bit is not None:
                    self.armed = bool(status.box_flags >> controller.arm_bit & 1)
            case Msp.ATTITUDE:
                self.attitude = decode_attitude(payload) or self.attitude
            case Msp.RAW_GPS:
                self.gps = decode_raw_gps(payload) or self.gps
            case Msp.ALTITUDE:
                self.altitude = decode_altitude(payload) or self.altitude
            case Msp.ANALOG:
                self.analog = decode_analog(payload) or self.analog
            case Msp.WP:
                home = decode_home(payload)
                if home is not None:
                    self.home = home if home.lat_e7 and home.lon_e7 else None

    def home_or_position(self) -> tuple[int, int] | None:
        """Return the flight controller's home, else where it stands with a fix: degrees * 1e7."""
        if self.home is not None:
            return self.home.lat_e7, self.home.lon_e7
        if self.gps is not None and self.gps.has_fix:
            return self.gps.lat_e7, self.gps.lon_e7
        return None
