# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri's MSP: the byte-by-byte receiver, and the replies to its commands (serial.c)."""

import struct
from collections.abc import Callable

from protocols.msp.frame import Direction, MspFrame
from simulator.board.flight import Craft
from simulator.board.msp_sensors import RSSI, MspCommand, SensorReplies
from simulator.board.options import Tree
from simulator.board.transmitter import box_activation, channels_us

_STOCK_BUFFER = 64
_VERSION = 211
_QUADX = 3
_MSP_VERSION = 0
_CAPABILITY = 0x8000_0000
_CYCLE_TIME_US = 3000
_ARM_BIT = 5
_BOXES = (
    "ANGLE", "HORIZON", "BARO", "MAG", "CAMSTAB", "ARM", "GPS HOME", "GPS HOLD", "GPS AUTO", "PASSTHRU",
    "HEADFREE", "BEEPER", "HEADADJ", "OSD SW", "GTUNE",
)  # fmt: skip
#: Roll and pitch, whose P the firmware divides by.
_CLAMPED_PIDS = (0, 3)
_PIDS = ("ROLL", "PITCH", "YAW", "ALT", "Pos", "PosR", "NavR", "LEVEL", "MAG", "VEL")
_MALFORMED_WP_SIZE = 12
_GPS_WITHOUT_COURSE = 14


_SETTERS = {
    MspCommand.SET_PID: MspCommand.PID,
    MspCommand.SET_BOX: MspCommand.BOX,
    MspCommand.SET_RC_TUNING: MspCommand.RC_TUNING,
}
_ACKNOWLEDGED = frozenset(
    (
        MspCommand.SET_RAW_RC,
        MspCommand.SET_RAW_GPS,
        MspCommand.ACC_CALIBRATION,
        MspCommand.MAG_CALIBRATION,
        MspCommand.SET_MISC,
        MspCommand.EEPROM_WRITE,
    )
)


class MspReceiver:
    """Finds requests as the firmware does: it trusts a header's size and never rescans.

    `buffer_size`: the largest payload. A larger size byte is refused. The stock firmware takes 64 and has no
    timeout: after a truncated frame it consumes the next's bytes until its count is reached.
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
    def buffer(self) -> bytes:
        """The payload of the last request, followed by leftovers of earlier requests."""
        return bytes(self._buffer)

    def overwrite(self, data: bytes) -> None:
        """The extension puts the replies into the same buffer."""
        self._buffer[: len(data)] = data

    def forget(self) -> None:
        """Drop a frame that has begun (the patched firmware's inter-byte timeout)."""
        self._state = 0

    def push(self, byte: int) -> tuple[int, bytes] | None:
        """Take a byte. Returns command and payload if it completes a request with a valid checksum."""
        state = self._state
        if state < 3:
            self._state = state + 1 if byte == b"$M<"[state] else 0
        elif state == 3:
            self._state = 0 if byte > len(self._buffer) else 4
            self._size = self._checksum = byte
            self._offset = 0
        elif state == 4:
            self._state = 5
            self._command = byte
            self._checksum ^= byte
        elif self._offset < self._size:
            self._buffer[self._offset] = byte
            self._offset += 1
            self._checksum ^= byte
        else:
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
        boxes = [box for box in _BOXES if box != "PASSTHRU" or tree is Tree.TESTCODE3]
        self._sensors = SensorReplies(dict(enumerate(boxes)), _CYCLE_TIME_US)
        self._defaults: dict[int, bytes] = {
            MspCommand.RC_TUNING: bytes((90, 65, 0, 0, 0, 50, 0)),
            MspCommand.PID: bytes((40, 30, 23)) * len(_PIDS),
            MspCommand.BOX: box_activation(len(boxes)),
        }
        #: The switch positions that arm.
        self.arm_switches = 0
        self._use(dict(self._defaults))

    def _use(self, settings: dict[int, bytes]) -> None:
        self._settings = settings
        (self.arm_switches,) = struct.unpack_from("<H", settings[MspCommand.BOX], 2 * _ARM_BIT)

    @property
    def box_size(self) -> int:
        """The payload of MSP_BOX and MSP_SET_BOX, bytes."""
        return len(self._settings[MspCommand.BOX])

    def answer(self, command: int, buffer: bytes) -> bytes:
        """The whole reply frame. `buffer`: the receive buffer, which the handlers read without regard to the size."""
        if command == MspCommand.WP:
            return self._waypoint(buffer[0])
        if command in _SETTERS:
            setting = _SETTERS[MspCommand(command)]
            values = buffer[: len(self._settings[setting])]
            if command == MspCommand.SET_PID:
                values = bytes(max(byte, 1) if at in _CLAMPED_PIDS else byte for at, byte in enumerate(values))
            self._use({**self._settings, setting: values})
            return reply(command)
        if command == MspCommand.RESET_CONF:
            self._use(dict(self._defaults))
            return reply(command)
        if command in _ACKNOWLEDGED:
            return reply(command)
        answer = self._read(command)
        return error(command) if answer is None else reply(command, answer)

    def _read(self, command: int) -> bytes | None:
        craft = self._craft()
        flags = craft.boxes & ~(1 << _ARM_BIT) | craft.armed << _ARM_BIT
        usual = self._sensors.payload(command, Craft(craft.flight, craft.armed, flags, craft.home, craft.acc))
        match command:
            case MspCommand.IDENT:
                return struct.pack("<BBBI", _VERSION, _QUADX, _MSP_VERSION, _CAPABILITY)
            case MspCommand.SERVO:
                return struct.pack("<8h", *(1500,) * 8)
            case MspCommand.RC:
                return struct.pack("<8H", *channels_us(craft.armed, craft.boxes))
            case MspCommand.RAW_GPS:
                return usual and usual[:_GPS_WITHOUT_COURSE]
            case MspCommand.ATTITUDE:
                return usual and usual + bytes(2)
            case MspCommand.ANALOG:
                return struct.pack("<BHH", round(craft.flight.volts * 10), 0, RSSI)
            case MspCommand.RC_TUNING | MspCommand.PID | MspCommand.BOX:
                return self._settings[MspCommand(command)]
            case MspCommand.MISC:
                return bytes(2)
            case MspCommand.MOTOR_PINS:
                return bytes(range(1, 9))
            case MspCommand.PIDNAMES:
                return "".join(f"{name};" for name in _PIDS).encode()
            case MspCommand.DEBUG:
                return bytes(8)
            case MspCommand.BOXIDS:
                return None
        return usual

    def _waypoint(self, number: int) -> bytes:
        craft = self._craft()
        match number:
            case 0:
                lat, lon = craft.home or (self._unknown_e7, self._unknown_e7)
            case 16:
                lat, lon = craft.flight.lat_e7, craft.flight.lon_e7
            case _:
                # The firmware announces 12 bytes, sends none, and closes with the checksum.
                return b"$M>" + bytes((_MALFORMED_WP_SIZE, MspCommand.WP, _MALFORMED_WP_SIZE ^ MspCommand.WP))
        return reply(MspCommand.WP, struct.pack("<BiiHB", number, lat, lon, 0, 0))


def reply(command: int, payload: bytes = b"") -> bytes:
    return MspFrame(Direction.REPLY, command, payload).encode()


def error(command: int, payload: bytes = b"") -> bytes:
    return MspFrame(Direction.ERROR, command, payload).encode()
