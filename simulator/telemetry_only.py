# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers simulated for their telemetry only: Betaflight 4.5 and baseflight.

Betaflight: src/main/msp/msp.c; baseflight: src/serial.c. Neither flies missions. In the air they circle (flight.fly).
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from simulator.flight import Craft, FlightState, fly
from simulator.msp_firmware import Boot, PortHabits, error, reply

_ARM = "ARM"
_SENSORS = 0b1111
_LOWEST, _MIDDLE, _HIGHEST = 1000, 1500, 2000


class TelemetryCommand(IntEnum):
    """The commands that both support."""

    STATUS = 101
    RC = 105
    RAW_GPS = 106
    COMP_GPS = 107
    ATTITUDE = 108
    ALTITUDE = 109
    ANALOG = 110
    BOXNAMES = 116
    BOXIDS = 119


_ABOUT_GPS = (TelemetryCommand.RAW_GPS, TelemetryCommand.COMP_GPS)


@dataclass(frozen=True, slots=True)
class Dialect:
    """The differences between them. `tails`: extra bytes after a command's usual payload.

    `constants`: the payloads of commands with a constant reply. `boxes`: names by permanent id. `has_gps`: False for
    Betaflight's own simulator, which is built without GPS and its messages.
    """

    habits: PortHabits
    constants: Mapping[int, bytes]
    boxes: Mapping[int, str]
    channels: int
    tails: Mapping[int, bytes]
    heading_from: int
    has_gps: bool = True


#: Its STATUS continues with load, gyro cycle, no further flags, and arming blockers; ANALOG with 0.01 V.
BETAFLIGHT = Dialect(
    PortHabits(buffer_size=192, cli_guard_s=0.1, obeys_r=True),
    {1: bytes((0, 1, 46)), 2: b"BTFL", 3: bytes((4, 5, 0)), 102: struct.pack("<9h", 0, 0, 512, 0, 0, 0, 0, 0, 0)},
    {
        0: _ARM, 1: "ANGLE", 2: "HORIZON", 6: "HEADFREE", 7: "HEADADJ", 13: "BEEPER", 19: "OSD DISABLE",
        20: "TELEMETRY", 26: "BLACKBOX", 27: "FAILSAFE", 28: "AIR MODE", 30: "FPV ANGLE MIX", 31: "BLACKBOX ERASE",
        35: "FLIP OVER AFTER CRASH", 36: "PREARM", 47: "ACRO TRAINER", 49: "LAUNCH CONTROL",
        51: "STICK COMMANDS DISABLE",
    },
    16,
    {
        TelemetryCommand.STATUS: struct.pack("<HHBBIBH", 12, 0, 0, 29, 0, 0, 35),
        TelemetryCommand.ANALOG: struct.pack("<H", 1260),
    },
    0,
    has_gps=False,
)  # fmt: skip
BASEFLIGHT = Dialect(
    PortHabits(buffer_size=128, cli_guard_s=0.0, obeys_r=True),
    {
        100: struct.pack("<BBBI", 231, 3, 4, 0xC000_000C),
        # It has home and a hold position as numbers 0 and 16, in its own layout, and acknowledges any number.
        118: bytes(18),
        209: b"",
        102: struct.pack("<9h", 0, 0, 512, 0, 0, 0, 210, 0, -430),
    },
    {0: _ARM, 1: "ANGLE", 2: "HORIZON", 3: "BARO", 5: "MAG", 6: "HEADFREE", 10: "GPS HOME", 11: "GPS HOLD"},
    8,
    {},
    -180,
)


class TelemetryFirmware:
    """See MspFirmware. The bits of `faults.boxes` are in the order of MSP_BOXIDS."""

    def __init__(self, dialect: Dialect, boot: Boot) -> None:
        self.habits = dialect.habits
        self._dialect = dialect
        self._faults = boot.faults
        self._arm_bit = list(dialect.boxes.values()).index(_ARM)
        self._booted_at = self._clock = boot.now
        self._flown = 0.0
        self._armed = False
        self._home: tuple[int, int] | None = None

    @property
    def armed(self) -> bool:
        """True if the craft is armed."""
        return self._armed

    @property
    def stored(self) -> list[bytes]:
        """None: it has no missions."""
        return []

    def take_busy_seconds(self) -> float:
        """0: it writes nothing."""
        return 0.0

    def follow_pilot(self, now: float) -> None:
        """Arm and disarm."""
        flight = self._fly(now)
        if self._armed != self._faults.armed:
            self._armed = self._faults.armed
            self._home = (flight.lat_e7, flight.lon_e7)

    def craft_at(self, now: float) -> Craft:
        """The sensor values."""
        boxes = self._faults.boxes & ~(1 << self._arm_bit) | self._armed << self._arm_bit
        return Craft(self._fly(now), self._armed, boxes & (1 << len(self._dialect.boxes)) - 1, self._home)

    def _fly(self, now: float) -> FlightState:
        self._flown += now - self._clock if self._armed else 0.0
        self._clock = now
        return fly(now - self._booted_at, self._flown, self._armed)

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply frame: an error frame for unknown commands."""
        if command in _ABOUT_GPS and not self._dialect.has_gps:
            return error(command)
        answer = self._dialect.constants.get(command, self._read(command, self.craft_at(now)))
        if answer is None:
            return error(command)
        return reply(command, answer + self._dialect.tails.get(command, b""))

    def _read(self, command: int, craft: Craft) -> bytes | None:
        flight = craft.flight
        match command:
            case TelemetryCommand.STATUS:
                return struct.pack("<HHHIB", 250, 0, _SENSORS, craft.boxes, 0)
            case TelemetryCommand.RC:
                sticks = (_MIDDLE, _MIDDLE, _MIDDLE, _LOWEST, _HIGHEST if self._armed else _LOWEST)
                channels = (*sticks, *(_MIDDLE,) * self._dialect.channels)[: self._dialect.channels]
                return struct.pack(f"<{len(channels)}H", *channels)
            case TelemetryCommand.RAW_GPS:
                position = (flight.lat_e7, flight.lon_e7, round(flight.altitude_m))
                motion = (round(flight.speed_ms * 100), round(flight.course * 10) % 3600)
                return struct.pack("<BBiiHHH", 1, flight.satellites, *position, *motion)
            case TelemetryCommand.COMP_GPS:
                distance, direction = craft.way_home()
                return struct.pack("<HhB", round(distance), self._heading(direction), 1)
            case TelemetryCommand.ATTITUDE:
                angles = (round(flight.roll * 10), round(flight.pitch * 10))
                return struct.pack("<hhh", *angles, self._heading(flight.heading))
            case TelemetryCommand.ALTITUDE:
                return struct.pack("<ih", round(flight.height_m * 100), round(flight.climb_ms * 100))
            case TelemetryCommand.ANALOG:
                return struct.pack("<BHHh", round(flight.volts * 10), 120, 920, 1250 if self._armed else 0)
            case TelemetryCommand.BOXNAMES:
                return "".join(f"{name};" for name in self._dialect.boxes.values()).encode()
            case TelemetryCommand.BOXIDS:
                return bytes(self._dialect.boxes)
        return None

    def _heading(self, degrees: float) -> int:
        """Whole degrees, from 0 or from -180."""
        return round(degrees - self._dialect.heading_from) % 360 + self._dialect.heading_from
