# SPDX-License-Identifier: GPL-3.0-or-later
"""The published state of a vehicle, in groups of named values: for zenoh, the web page and the command line.

None means "not known", or not heard recently (`Vehicle.fresh`). The notes on the fields are part of the published
schemas (payloads/schemas).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated


class Group(Enum):
    """The groups. Each is published as a whole."""

    ATTITUDE = "attitude"
    POSITION = "position"
    GPS = "gps"
    BATTERY = "battery"
    RC = "rc"
    STATUS = "status"
    LINK = "link"

    # Enum's own is a Python function, and groups are looked up several times for each sample.
    __hash__ = object.__hash__


#: A field of every group.
Age = Annotated[
    float | None,
    "age of the oldest of its values, seconds; if all are null, since the last one was heard; null: never heard",
]


@dataclass(frozen=True, slots=True)
class Attitude:
    """The vehicle's attitude."""

    roll_deg: Annotated[float | None, "right side down is positive"] = None
    pitch_deg: Annotated[float | None, "nose up is positive"] = None
    heading_deg: Annotated[float | None, "0 up to 360, clockwise from north; only with a compass"] = None
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Position:
    """The vehicle's position. Height and climb come from the barometer, all others need a GPS fix."""

    lat_deg: Annotated[float | None, "WGS 84"] = None
    lon_deg: Annotated[float | None, "WGS 84"] = None
    altitude_m: Annotated[float | None, "above the sea, by GPS"] = None
    height_m: Annotated[float | None, "above the launch point, estimated by the flight controller"] = None
    climb_m_s: Annotated[float | None, "upwards is positive"] = None
    north_m_s: Annotated[float | None, "speed over ground"] = None
    east_m_s: Annotated[float | None, "speed over ground"] = None
    home_lat_deg: Annotated[float | None, "the place of arming; before that, the current position"] = None
    home_lon_deg: Annotated[float | None, "the place of arming; before that, the current position"] = None
    home_distance_m: float | None = None
    home_direction_deg: Annotated[float | None, "clockwise from north"] = None
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Gps:
    """The satellite receiver's status."""

    fix: Annotated[str | None, "none, 2D or 3D"] = None
    satellites: Annotated[int | None, "used"] = None
    hdop: Annotated[float | None, "horizontal dilution of precision"] = None
    ground_speed_m_s: Annotated[float | None, "speed over ground"] = None
    course_deg: Annotated[float | None, "of the movement, clockwise from north"] = None
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Battery:
    """Battery measurements."""

    voltage_v: float | None = None
    current_a: float | None = None
    drawn_mah: Annotated[int | None, "since the flight controller was switched on"] = None
    cells: Annotated[int | None, "estimated from the voltage, unless the flight controller knows"] = None
    remaining_percent: Annotated[int | None, "estimated from the voltage, unless the flight controller knows"] = None
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Rc:
    """Input from the pilot's transmitter."""

    channels_us: Annotated[tuple[int, ...] | None, "pulse widths: roll, pitch, throttle, yaw, then aux 1.."] = None
    rssi_percent: Annotated[float | None, "signal strength"] = None
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Status:
    """The flight controller's status."""

    armed: bool | None = None
    mode: Annotated[
        str | None,
        "MANUAL, ACRO, STABILIZE, HORIZON, ALT_HOLD, LOITER, CRUISE, RTL, AUTO, LAUNCH; an autopilot's own: its number",
    ] = None
    sensors: Annotated[tuple[str, ...] | None, "sensors on board that respond"] = None
    cycle_time_us: Annotated[int | None, "main loop time"] = None
    i2c_errors: Annotated[int | None, "since its start"] = None
    readiness: Annotated[str, "ready, blocked, calibrating, writing, lost, never found or unknown"] = "unknown"
    not_ready_why: Annotated[tuple[str, ...], "the reasons not to arm, while disarmed"] = ()
    age_s: Age = None


@dataclass(frozen=True, slots=True)
class Link:
    """The link between the bridge and its flight controller."""

    state: Annotated[str, "no port, searching, identifying, MSP or MAVLink"]
    flight_controller: Annotated[str | None, "its name"] = None
    speed_baud: Annotated[int | None, "of the port"] = None
    round_trip_ms: Annotated[float | None, "from a request to its reply"] = None
    requests_lost: Annotated[int | None, "requests without a reply since it was found"] = None
    bad_checksums: Annotated[int | None, "damaged replies since it was found"] = None
    ground_stations: Annotated[tuple[str, ...], "connected over MAVLink"] = ()


class Progress(Enum):
    """MAVLink's MISSION_STATE."""

    UNKNOWN = 0
    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5

    @property
    def text(self) -> str:
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True, slots=True)
class MissionIdentity:
    """The identity of the flight controller's mission."""

    count: Annotated[int, "records, home included; 0: none"]
    checksum: Annotated[str, "CRC-32 over the records, 8 hexadecimal digits"]
    state: Annotated[
        str | None,
        "not started, active, paused or complete; null: not reported (by a Harakiri without mission flight)",
    ] = None
    item: Annotated[int | None, "the item being flown, as read back; null: none, or not reported"] = None
    why: Annotated[str | None, "why its flight stopped, is slow, or has ended; null: not reported"] = None


@dataclass(frozen=True, slots=True)
class SettingsIdentity:
    """The identity of the flight controller's settings."""

    seal: Annotated[str, "CRC-32 over them, 8 hexadecimal digits"]
    changed: Annotated[str | None, "the last change that did not come through the bridge, for people"]


@dataclass(frozen=True, slots=True)
class LastHeard:
    """The values to find a silent craft by: the last known values, however old."""

    armed: bool | None = None
    armed_age_s: Annotated[float | None, "seconds since it was heard"] = None
    mode: Annotated[str | None, "as in status"] = None
    mode_age_s: Annotated[float | None, "seconds since it was heard"] = None
    lat_deg: Annotated[float | None, "WGS 84"] = None
    lon_deg: Annotated[float | None, "WGS 84"] = None
    place_age_s: Annotated[float | None, "seconds since it was heard"] = None


@dataclass(frozen=True, slots=True)
class VehicleReport:
    """All groups together."""

    attitude: Attitude
    position: Position
    gps: Gps
    battery: Battery
    rc: Rc
    status: Status
    link: Link
    mission: MissionIdentity | None
    settings: SettingsIdentity | None
    last_heard: LastHeard
