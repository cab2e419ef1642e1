# SPDX-License-Identifier: GPL-3.0-or-later
"""A u-blox GPS module on a serial port: NMEA until the board configures it, then UBX.

Protocol: u-blox 6 Receiver Description (GPS.G6-SW-10018), NMEA sentences GGA and RMC, PUBX,41 and the UBX messages
NAV-STATUS, NAV-POSLLH, NAV-SOL and NAV-VELNED.
"""

import random
import struct
from collections import deque
from dataclasses import dataclass
from math import atan2, degrees, hypot

from simulator.sky.earth import Place
from simulator.sky.lies import Lies
from simulator.sky.noise import Wander
from simulator.sky.vectors import Vector

#: The time between two measurements.
_PERIOD_S = 0.2
#: Standard deviations: metres, correlated over a minute; metres and m/s of one measurement.
_WANDER_M, _WANDER_S, _POSITION_NOISE, _SPEED_NOISE = 0.7, 60.0, 0.02, 0.05
_SATELLITES, _SATELLITES_LOST = 9, 3
_SYNC = b"\xb5\x62"
_NAV, _CONFIGURATION = 0x01, 0x06
_POSLLH, _STATUS, _SOL, _VELNED = 0x02, 0x03, 0x06, 0x12
_FIX_3D, _NO_FIX = 3, 0
_KNOT = 0.514444


@dataclass(frozen=True, slots=True)
class Measurement:
    """One fix: degrees, metres above sea level, m/s north, east and down."""

    at_s: float
    lat: float
    lon: float
    alt_m: float
    velocity_ned: Vector
    has_fix: bool
    satellites: int

    @property
    def speed(self) -> float:
        return hypot(self.velocity_ned[0], self.velocity_ned[1])

    @property
    def course_deg(self) -> float:
        return degrees(atan2(self.velocity_ned[1], self.velocity_ned[0])) % 360


class GpsModule:
    """`has_fix` and `is_silent` may be set at any time: the sky is hidden, or the wire is broken.

    Until the board configures it, it speaks NMEA at the board's speed, as set by the owner.
    """

    def __init__(self, place: Place, seed: int = 0, lies: Lies | None = None) -> None:
        self._lies = lies or Lies()
        self._drifted_m = 0.0
        self.has_fix = True
        self.is_silent = False
        self._place = place
        self._noise = random.Random(f"gps {seed}")
        self._wander = [Wander(self._noise, _WANDER_M, _WANDER_S) for _ in range(3)]
        self._baud: int | None = None
        self._speaks_ubx = False
        self._heard = bytearray()
        self._pending: deque[Measurement] = deque()
        self._next_s = 0.0

    @property
    def next_s(self) -> float:
        """When it measures or sends next."""
        due = self._pending[0].at_s + self._lies.gps_lag if self._pending else self._next_s
        return min(due, self._next_s)

    def hear(self, data: bytes, baud: int) -> None:
        """Bytes from the board at the speed; other speeds are noise."""
        if self._baud not in (None, baud):
            return
        self._heard += data
        while (end := self._heard.find(b"\n")) >= 0 and _SYNC not in self._heard[:end]:
            fields = bytes(self._heard[:end]).strip().split(b"*")[0].split(b",")
            del self._heard[: end + 1]
            if fields[0].endswith(b"$PUBX") and len(fields) > 5 and fields[1] == b"41":
                self._baud = int(fields[5])
        while (start := self._heard.find(_SYNC)) >= 0 and len(self._heard) >= start + 8:
            kind, length = self._heard[start + 2], int.from_bytes(self._heard[start + 4 : start + 6], "little")
            if len(self._heard) < start + 8 + length:
                break
            self._speaks_ubx = self._speaks_ubx or kind == _CONFIGURATION
            del self._heard[: start + 8 + length]
        del self._heard[:-512]

    def advance(self, now_s: float, position: Vector, velocity: Vector) -> None:
        """Measure, if it is time."""
        if now_s >= self._next_s:
            self._next_s += _PERIOD_S
            self._pending.append(self._measure(now_s, position, velocity))

    def take(self, now_s: float, board_baud: int) -> bytes:
        """The bytes it sends now, or b"" if there is nothing new, or the board listens at another speed."""
        sent = b""
        while self._pending and self._pending[0].at_s + self._lies.gps_lag <= now_s:
            measurement = self._pending.popleft()
            sent += _ubx(measurement) if self._speaks_ubx else _nmea(measurement)
        if self.is_silent or self._baud not in (None, board_baud):
            return b""
        return sent

    def _measure(self, now_s: float, position: Vector, velocity: Vector) -> Measurement:
        gauss = self._noise.gauss
        north, west, up = (
            true + wander.step(_PERIOD_S) + gauss(0, _POSITION_NOISE)
            for true, wander in zip(position, self._wander, strict=True)
        )
        self._drifted_m += self._lies.gps_drift * _PERIOD_S
        lat, lon = self._place.coordinates((north + self._lies.gps_jump + self._drifted_m, west, up))
        ned = (
            velocity[0] + self._lies.gps_drift + gauss(0, _SPEED_NOISE),
            -velocity[1] + gauss(0, _SPEED_NOISE),
            -velocity[2] + gauss(0, _SPEED_NOISE),
        )
        count = _SATELLITES if self.has_fix else _SATELLITES_LOST
        return Measurement(now_s, lat, lon, self._place.alt_m + up, ned, self.has_fix, count)


def _ubx(m: Measurement) -> bytes:
    time = round(m.at_s * 1000)
    fix, flags = (_FIX_3D, 1) if m.has_fix else (_NO_FIX, 0)
    north, east, down = (round(100 * part) for part in m.velocity_ned)
    status = struct.pack("<IBBBBII", time, fix, flags, 0, 0, 0, time)
    position = struct.pack(
        "<IiiiiII",
        time,
        round(m.lon * 1e7),
        round(m.lat * 1e7),
        round(m.alt_m * 1000),
        round(m.alt_m * 1000),
        1500,
        2500,
    )
    solution = struct.pack(
        "<IihBBiiiIiiiIHBBI", time, 0, 0, fix, flags, 0, 0, 0, 0, 0, 0, 0, 0, 150, 0, m.satellites, 0
    )
    speed = round(100 * m.speed)
    velocity = struct.pack("<IiiiIIiII", time, north, east, down, speed, speed, round(m.course_deg * 1e5), 20, 100000)
    frames = ((_STATUS, status), (_SOL, solution), (_POSLLH, position), (_VELNED, velocity))
    return b"".join(_ubx_frame(_NAV, kind, payload) for kind, payload in frames)


def _ubx_frame(group: int, kind: int, payload: bytes) -> bytes:
    body = struct.pack("<BBH", group, kind, len(payload)) + payload
    a = b = 0
    for byte in body:
        a = a + byte & 0xFF
        b = b + a & 0xFF
    return _SYNC + body + bytes((a, b))


def _nmea(m: Measurement) -> bytes:
    seconds = m.at_s % 86_400
    time = f"{int(seconds // 3600):02}{int(seconds // 60 % 60):02}{seconds % 60:05.2f}"
    lat = f"{_sexagesimal(m.lat, 2)},{'N' if m.lat >= 0 else 'S'}"
    lon = f"{_sexagesimal(m.lon, 3)},{'E' if m.lon >= 0 else 'W'}"
    return _sentence(
        f"GPGGA,{time},{lat},{lon},{int(m.has_fix)},{m.satellites},1.50,{m.alt_m:.1f},M,0.0,M,,"
    ) + _sentence(
        f"GPRMC,{time},{'A' if m.has_fix else 'V'},{lat},{lon},{m.speed / _KNOT:.3f},{m.course_deg:.1f},010126,,,A"
    )


def _sexagesimal(angle: float, digits: int) -> str:
    angle = abs(angle)
    return f"{int(angle):0{digits}}{angle % 1 * 60:07.4f}"


def _sentence(text: str) -> bytes:
    checksum = 0
    for byte in text.encode():
        checksum ^= byte
    return f"${text}*{checksum:02X}\r\n".encode()
