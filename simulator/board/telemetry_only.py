# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers simulated for their telemetry only: Betaflight 4.5 and baseflight.

Betaflight: src/main/msp/msp.c; baseflight: src/serial.c. Neither flies missions. In the air they circle (flight.fly).
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

from simulator.board.flight import FlightState, fly
from simulator.board.msp_firmware import Boot, MspFirmware, PortHabits
from simulator.board.msp_port import error, reply
from simulator.board.msp_sensors import MspCommand, SensorReplies
from simulator.board.part_settings import PartSettings

_ARM = "ARM"

#: ARM on aux 1 high, ANGLE on aux 2 high.
_RANGES = bytes((0, 0, 32, 48, 1, 1, 32, 48)).ljust(20 * 4, b"\0")
_ABOUT_GPS = (MspCommand.RAW_GPS, MspCommand.COMP_GPS)


@dataclass(frozen=True, slots=True)
class Dialect:
    """The differences between them. `tails`: extra bytes after a command's usual payload.

    `constants`: the payloads of commands with a constant reply. `has_gps`: False for Betaflight's own simulator, which
    is built without GPS and the messages. `settings`: the replies that setters change.
    """

    habits: PortHabits
    constants: Mapping[int, bytes]
    sensors: SensorReplies
    tails: Mapping[int, bytes] = field(default_factory=dict)
    has_gps: bool = True
    settings: Mapping[int, bytes] = field(default_factory=dict)


#: A blank board: of eight UARTs the first has MSP (1); 115200 baud (5) for MSP and black box, 57600 (4) for GPS.
_UARTS, _FUNCTIONS, _BAUDS = range(8), (1, *(0,) * 7), bytes((5, 4, 0, 5))
_SERIAL_CONFIG = b"".join(struct.pack("<BH", uart, _FUNCTIONS[uart]) + _BAUDS for uart in _UARTS)
_COMMON_SERIAL_CONFIG = b"\x08" + b"".join(struct.pack("<BI", uart, _FUNCTIONS[uart]) + _BAUDS for uart in _UARTS)

#: Its STATUS continues with load, gyro cycle, no further flags, and arming blockers; ANALOG with 0.01 V.
BETAFLIGHT = Dialect(
    PortHabits(buffer_size=192, cli_guard_s=0.1, obeys_r=True, speaks_v2=True),
    {
        54: _SERIAL_CONFIG, 0x1009: _COMMON_SERIAL_CONFIG,
        1: bytes((0, 1, 46)), 2: b"BTFL", 3: bytes((4, 5, 0)), 102: struct.pack("<9h", 0, 0, 512, 0, 0, 0, 0, 0, 0),
        117: b"ROLL;PITCH;YAW;LEVEL;MAG;",
    },
    SensorReplies(
        {
            0: _ARM, 1: "ANGLE", 2: "HORIZON", 6: "HEADFREE", 7: "HEADADJ", 13: "BEEPER", 19: "OSD DISABLE",
            20: "TELEMETRY", 26: "BLACKBOX", 27: "FAILSAFE", 28: "AIR MODE", 30: "FPV ANGLE MIX", 31: "BLACKBOX ERASE",
            35: "FLIP OVER AFTER CRASH", 36: "PREARM", 47: "ACRO TRAINER", 49: "LAUNCH CONTROL",
            51: "STICK COMMANDS DISABLE",
        },
        250,
        channels=16,
        heading_from=0,
    ),
    {
        MspCommand.STATUS: struct.pack("<HHBBIBH", 12, 0, 0, 29, 0, 0, 35),
        MspCommand.ANALOG: struct.pack("<H", 1260),
    },
    has_gps=False,
    settings={
        MspCommand.PID: bytes((45, 80, 30, 47, 84, 34, 45, 80, 0, 50, 75, 75, 40, 0, 0)),
        MspCommand.RC_TUNING: bytes((7, 0, 67, 67, 67, 0, 50, 0, 70, 5, 0, 7, 7, 0, 0, 100, *(206, 7) * 3, 3)),
        34: _RANGES,
    },
)  # fmt: skip
BASEFLIGHT = Dialect(
    PortHabits(buffer_size=128, cli_guard_s=0.0, obeys_r=True),
    {
        100: struct.pack("<BBBI", 231, 3, 4, 0xC000_000C),
        # It has home and a hold position as numbers 0 and 16, in its own layout, and acknowledges any number.
        118: bytes(18),
        117: b"ROLL;PITCH;YAW;ALT;Pos;PosR;NavR;LEVEL;MAG;VEL;",
        209: b"",
        102: struct.pack("<9h", 0, 0, 512, 0, 0, 0, 210, 0, -430),
    },
    SensorReplies(
        {0: _ARM, 1: "ANGLE", 2: "HORIZON", 3: "BARO", 5: "MAG", 6: "HEADFREE", 10: "GPS HOME", 11: "GPS HOLD"}, 250
    ),
    settings={
        MspCommand.PID: bytes((40, 30, 23)) * 10,
        MspCommand.BOX: b"\x04\0\x20".ljust(16, b"\0"),
        MspCommand.RC_TUNING: bytes((90, 65, 0, 0, 0, 50, 0)),
        MspCommand.MISC: struct.pack("<5H6BH4B", 1500, 1150, 1850, 1000, 1200, *bytes(6), 0, 110, 33, 43, 34),
    },
)


class TelemetryFirmware(MspFirmware):
    """Cannot store missions."""

    def __init__(self, dialect: Dialect, boot: Boot) -> None:
        super().__init__(boot)
        self.habits = dialect.habits
        self._dialect = dialect
        self._settings = PartSettings(dialect.settings, boot.eeprom)
        self._arm_bit = list(dialect.sensors.boxes.values()).index(_ARM)
        self._booted_at = boot.now
        self._flown = 0.0

    def follow_pilot(self, now: float) -> None:
        self._fly_until(now)
        if self.armed != self._faults.armed:
            flight = self._state()
            self.armed = self._faults.armed
            self._home = (flight.lat_e7, flight.lon_e7)

    def _fly(self, seconds: float) -> None:
        self._flown += seconds

    def _state(self) -> FlightState:
        return fly(self._clock - self._booted_at, self._flown, self.armed)

    def _flags(self) -> int:
        boxes = self._faults.boxes & ~(1 << self._arm_bit) | self.armed << self._arm_bit
        return boxes & (1 << len(self._dialect.sensors.boxes)) - 1

    def answer(self, command: int, payload: bytes, now: float) -> bytes | None:
        """The reply frame: an error frame for unknown commands."""
        if command in _ABOUT_GPS and not self._dialect.has_gps:
            return error(command)
        if command == MspCommand.EEPROM_WRITE and not self.armed:
            self._settings.save()
            self._busy += self._options.eeprom_write_ms / 1000
            return reply(command)
        if self._settings.write(command, payload):
            return reply(command)
        if (held := self._settings.read(command)) is not None:
            return reply(command, held)
        answer = self._dialect.constants.get(command, self._dialect.sensors.payload(command, self.craft_at(now)))
        if answer is None:
            return error(command)
        return reply(command, answer + self._dialect.tails.get(command, b""))
