# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's MSP: the byte-by-byte receiver, and the replies to its commands (serial.c)."""

import struct
from collections.abc import Callable
from enum import IntEnum

from protocols.msp.frame import Direction, MspFrame
from simulator.flight import Craft
from simulator.options import Tree
from simulator.transmitter import box_activation, channels_us

_STOCK_BUFFER = 64
_VERSION = 211
_QUADX = 3
_MSP_VERSION = 0
_CAPABILITY = 0x8000_0000
_CYCLE_TIME_US = 3000
_SENSORS = 0b1111  # accelerometer, barometer, magnetometer, GPS
_ARM_BIT = 5
_BOXES = (
    "ANGLE", "HORIZON", "BARO", "MAG", "CAMSTAB", "ARM", "GPS HOME", "GPS HOLD", "GPS AUTO", "PASSTHRU",
    "HEADFREE", "BEEPER", "HEADADJ", "OSD SW", "GTUNE",
)  # fmt: skip
#: Roll and pitch, whose P the firmware divides by.
_CLAMPED_PIDS = (0, 3)
_PIDS = ("ROLL", "PITCH", "YAW", "ALT", "Pos", "PosR", "NavR", "LEVEL", "MAG", "VEL")
_RSSI = 230
_HOME, _HOLD = 0, 16
_MALFORMED_WP_SIZE = 12


class HarakiriCommand(IntEnum):
    """Harakiri's commands."""

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
    BAT = 110
    RC_TUNING = 111
    PID = 112
    BOX = 113
    MISC = 114
    MOTOR_PINS = 115
    BOXNAMES = 116
    PIDNAMES = 117
    WP = 118
    SET_RAW_RC = 200
    SET_RAW_GPS = 201
    SET_PID = 202
    SET_BOX = 203
    SET_RC_TUNING = 204
    ACC_CALIBRATION = 205
    MAG_CALIBRATION = 206
    SET_MISC = 207
    RESET_CONF = 208
    EEPROM_WRITE = 250
    DEBUG = 254


_SETTERS = {
    HarakiriCommand.SET_PID: HarakiriCommand.PID,
    HarakiriCommand.SET_BOX: HarakiriCommand.BOX,
    HarakiriCommand.SET_RC_TUNING: HarakiriCommand.RC_TUNING,
}
_ACKNOWLEDGED = frozenset(
    (
        HarakiriCommand.SET_RAW_RC,
        HarakiriCommand.SET_RAW_GPS,
        HarakiriCommand.ACC_CALIBRATION,
        HarakiriCommand.MAG_CALIBRATION,
        HarakiriCommand.SET_MISC,
        HarakiriCommand.RESET_CONF,
        HarakiriCommand.EEPROM_WRITE,
    )
)


class MspReceiver:
    """Finds requests as the firmware does: it trusts a header's size and never rescans.

    `buffer_size`: the largest payload; a larger size byte is refused. The stock firmware takes 64 and has no
    timeout: after a truncated frame it consumes the next one's bytes until its count is reached.
    """

    def __init__(self, buffer_size: int = _STOCK_BUFFER) -> None:
        self._buffer = bytearray(buffer_size)
        self._state = 0
        self._size = 0
        self._checksum = 0
        self._offset = 0
        self._command = 0

    @property
    def in_frame(self) -> bool:
        return self._state != 0

    @property
    def is_past_header(self) -> bool:
        """True if `$M<` has been read, and not the frame's end."""
        return self._state > 2

    @property
    def leftover(self) -> bytes:
        """The buffer's content from earlier frames, which the firmware reads if a payload is missing."""
        return bytes(self._buffer)

    def overwrite(self, data: bytes) -> None:
        """The extension puts its replies into the same buffer."""
        self._buffer[: len(data)] = data

    def forget(self) -> None:
        """Drop a frame that has begun (the patched firmware's inter-byte timeout)."""
        self._state = 0

    def push(self, byte: int) -> tuple[int, bytes] | None:
        """Take a byte; returns command and payload if it completes a request with a valid checksum."""
        match self._state:
            case 0 | 1 | 2:
                self._state = self._state + 1 if byte == b"$M<"[self._state] else 0
            case 3:
                self._state = 0 if byte > len(self._buffer) else 4
                self._size = self._checksum = byte
                self._offset = 0
            case 4:
                self._state = 5
                self._command = byte
                self._checksum ^= byte
            case _ if self._offset < self._size:
                self._buffer[self._offset] = byte
                self._offset += 1
                self._checksum ^= byte
            case _:
                self._state = 0
                if self._checksum == byte:
                    return self._command, bytes(self._buffer[: self._size])
        return None


class MspAnswers:
    """The replies to the stock commands. `craft` returns the current state."""

    def __init__(self, craft: Callable[[], Craft], tree: Tree) -> None:
        self._craft = craft
        #: GPSLatLonErrorVal in HarakiriWebstore1's mw.h.
        self._unknown_e7 = 0 if tree is Tree.TESTCODE3 else 1_900_000_000
        self._boxes = [box for box in _BOXES if box != "PASSTHRU" or tree is Tree.TESTCODE3]
        self._settings = {
            HarakiriCommand.RC_TUNING: bytes((90, 65, 0, 0, 0, 50, 0)),
            HarakiriCommand.PID: bytes((40, 30, 23)) * len(_PIDS),
            HarakiriCommand.BOX: box_activation(len(self._boxes)),
        }

    def answer(self, command: int, payload: bytes) -> bytes:
        """The whole reply frame. The caller handles WP without a payload."""
        if command == HarakiriCommand.WP:
            return self._waypoint(payload)
        if command in _SETTERS:
            setting = _SETTERS[HarakiriCommand(command)]
            if len(payload) == len(self._settings[setting]):
                if command == HarakiriCommand.SET_PID:
                    payload = bytes(max(byte, 1) if at in _CLAMPED_PIDS else byte for at, byte in enumerate(payload))
                self._settings[setting] = payload
            return reply(command)
        if command in _ACKNOWLEDGED:
            return reply(command)
        answer = self._read(command)
        return MspFrame(Direction.ERROR, command).encode() if answer is None else reply(command, answer)

    def _read(self, command: int) -> bytes | None:
        craft = self._craft()
        flight, armed = craft.flight, craft.armed
        match command:
            case HarakiriCommand.IDENT:
                return struct.pack("<BBBI", _VERSION, _QUADX, _MSP_VERSION, _CAPABILITY)
            case HarakiriCommand.STATUS:
                flags = craft.boxes & ~(1 << _ARM_BIT) | armed << _ARM_BIT
                return struct.pack("<HHHIB", _CYCLE_TIME_US, 0, _SENSORS, flags, 0)
            case HarakiriCommand.RAW_IMU:
                return struct.pack("<9h", 0, 0, 512, 0, 0, 0, 210, 0, -430)
            case HarakiriCommand.SERVO:
                return struct.pack("<8h", *(1500,) * 8)
            case HarakiriCommand.MOTOR:
                return struct.pack("<8h", *(1450 if armed else 1000,) * 4, *(0,) * 4)
            case HarakiriCommand.RC:
                return struct.pack("<8H", *channels_us(armed, craft.boxes))
            case HarakiriCommand.RAW_GPS:
                position = (
                    flight.lat_e7,
                    flight.lon_e7,
                    round(flight.altitude_m),
                    round(flight.speed_ms * 100),
                )
                return struct.pack("<BBiiHH", 1, flight.satellites, *position)
            case HarakiriCommand.COMP_GPS:
                distance, direction = craft.way_home()
                return struct.pack("<HhB", round(distance), round((direction + 180) % 360 - 180), 1)
            case HarakiriCommand.ATTITUDE:
                heading = round((flight.heading + 180) % 360 - 180)
                return struct.pack("<4h", round(flight.roll * 10), round(flight.pitch * 10), heading, 0)
            case HarakiriCommand.ALTITUDE:
                return struct.pack("<ih", round(flight.height_m * 100), round(flight.climb_ms * 100))
            case HarakiriCommand.BAT:
                return struct.pack("<BHH", round(flight.volts * 10), 0, _RSSI << 2)
            case HarakiriCommand.RC_TUNING | HarakiriCommand.PID | HarakiriCommand.BOX:
                return self._settings[HarakiriCommand(command)]
            case HarakiriCommand.MISC:
                return bytes(2)
            case HarakiriCommand.MOTOR_PINS:
                return bytes(range(1, 9))
            case HarakiriCommand.BOXNAMES:
                return "".join(f"{name};" for name in self._boxes).encode()
            case HarakiriCommand.PIDNAMES:
                return "".join(f"{name};" for name in _PIDS).encode()
            case HarakiriCommand.DEBUG:
                return bytes(8)
        return None

    def _waypoint(self, payload: bytes) -> bytes:
        craft = self._craft()
        match payload[0]:
            case 0:
                number, (lat, lon) = _HOME, craft.home or (self._unknown_e7, self._unknown_e7)
            case 16:
                number, lat, lon = _HOLD, craft.flight.lat_e7, craft.flight.lon_e7
            case _:
                # The firmware announces 12 bytes, sends none, and closes with the checksum.
                return b"$M>" + bytes((_MALFORMED_WP_SIZE, HarakiriCommand.WP, _MALFORMED_WP_SIZE ^ HarakiriCommand.WP))
        return reply(HarakiriCommand.WP, struct.pack("<BiiHB", number, lat, lon, 0, 0))


def reply(command: int, payload: bytes = b"") -> bytes:
    return MspFrame(Direction.REPLY, command, payload).encode()
