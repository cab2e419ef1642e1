# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii's commands and telemetry replies. INAV's, Betaflight's and baseflight's differ only in details."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from simulator.board.flight import Craft

_LOWEST_US, _MIDDLE_US, _HIGHEST_US = 1000, 1500, 2000
_CRUISE_US = 1450
DRAWN_MAH, RSSI = 120, 920
_STATUS_FLAGS = (1 << 32) - 1


class MspCommand(IntEnum):
    """MultiWii's commands. Each firmware has some of them."""

    IDENT = 100
    STATUS = 101
    RAW_IMU = 102
    SERVO = 103
    MOTOR = 104
    RC = 105
    RAW_GPS = 106
    COMP_GPS = 107
    ATTITUDE = 108
    ALTITUDE = 109
    ANALOG = 110
    RC_TUNING = 111
    PID = 112
    BOX = 113
    MISC = 114
    MOTOR_PINS = 115
    BOXNAMES = 116
    PIDNAMES = 117
    WP = 118
    BOXIDS = 119
    NAV_STATUS = 121
    NAV_CONFIG = 122
    SET_RAW_RC = 200
    SET_RAW_GPS = 201
    SET_PID = 202
    SET_BOX = 203
    SET_RC_TUNING = 204
    ACC_CALIBRATION = 205
    MAG_CALIBRATION = 206
    SET_MISC = 207
    RESET_CONF = 208
    SET_WP = 209
    EEPROM_WRITE = 250
    DEBUG = 254


@dataclass(frozen=True, slots=True)
class SensorReplies:
    """`boxes`: the modes' names by permanent id, in the order of the status flags.

    `sensors`: in STATUS. By default accelerometer, barometer, magnetometer and GPS.
    `channels`: in RC. `heading_from`: headings begin at 0 or at -180. `fix_3d`: the code of a 3D fix in RAW_GPS.
    `currents_ca`: disarmed and armed, 0.01 A.
    """

    boxes: Mapping[int, str]
    cycle_time_us: int
    sensors: int = 0b1111
    channels: int = 8
    heading_from: int = -180
    fix_3d: int = 1
    currents_ca: tuple[int, int] = (0, 1250)

    def payload(self, command: int, craft: Craft) -> bytes | None:
        """A reply's payload, or None for other commands."""
        flight, armed = craft.flight, craft.armed
        match command:
            case MspCommand.STATUS:
                flags = craft.boxes & _STATUS_FLAGS
                return struct.pack("<HHHIB", self.cycle_time_us, 0, self.sensors, flags, 0)
            case MspCommand.RAW_IMU:
                return struct.pack("<9h", *craft.acc, 0, 0, 0, 210, 0, -430)
            case MspCommand.MOTOR:
                return struct.pack("<8H", *(_CRUISE_US if armed else _LOWEST_US,) * 4, *(0,) * 4)
            case MspCommand.RC:
                throttle, arm = (_CRUISE_US, _HIGHEST_US) if armed else (_LOWEST_US, _LOWEST_US)
                channels = (*(_MIDDLE_US,) * 3, throttle, arm, *(_MIDDLE_US,) * self.channels)[: self.channels]
                return struct.pack(f"<{len(channels)}H", *channels)
            case MspCommand.RAW_GPS:
                position = (flight.lat_e7, flight.lon_e7, round(flight.altitude_m))
                motion = (round(flight.speed_ms * 100), round(flight.course * 10) % 3600)
                return struct.pack("<BBiihHH", self.fix_3d, flight.satellites, *position, *motion)
            case MspCommand.COMP_GPS:
                distance, direction = craft.way_home()
                return struct.pack("<HhB", round(distance), self._heading(direction), 1)
            case MspCommand.ATTITUDE:
                angles = (round(flight.roll * 10), round(flight.pitch * 10))
                return struct.pack("<hhh", *angles, self._heading(flight.heading))
            case MspCommand.ALTITUDE:
                return struct.pack("<ih", round(flight.height_m * 100), round(flight.climb_ms * 100))
            case MspCommand.ANALOG:
                return struct.pack("<BHHh", round(flight.volts * 10), DRAWN_MAH, RSSI, self.currents_ca[armed])
            case MspCommand.BOXNAMES:
                return "".join(f"{name};" for name in self.boxes.values()).encode()
            case MspCommand.BOXIDS:
                return bytes(self.boxes)
        return None

    def _heading(self, degrees: float) -> int:
        return round(degrees - self.heading_from) % 360 + self.heading_from
