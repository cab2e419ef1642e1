# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own SITL (a path in INAV_SITL) with a craft around it, over MSP: its HITL interface (fc_msp.c, MSP_SIMULATOR).

The craft is a rigid body without inertia: rates follow INAV's stabilising outputs, thrust its throttle. Body axes are
forward, left and up, world axes north, west and up.
"""

import socket
import struct
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from math import atan2, cos, degrees, hypot, radians, sin
from pathlib import Path

import pytest

from protocols.msp.commands import Msp
from protocols.msp.frame import Direction, MspFrame, MspParser, request
from protocols.msp.inav import decode_inav_status
from protocols.msp.inav_places import GEOZONE_FEATURE, SET_GEOZONE, SET_GEOZONE_VERTEX, Geozone
from protocols.msp.inav_settings import (
    COMMON_SET_SETTING,
    COMMON_SETTING_INFO,
    decode_setting_info,
    encode_about_name,
    pack_value,
)
from protocols.msp.nav import Nav, NavRecord, NavStatus, decode_nav_status, encode_set_wp

LAT_E7, LON_E7 = 453_838_000, 84_733_000
_E7_PER_M, _E7_PER_M_EAST = 1e7 / 111_195, 1e7 / 78_100
_FIELD_M = 200.0
_SIMULATOR, _RAW_RC, _REBOOT, _SAVE = 0x201F, 200, 68, 250
_FEATURES, _SET_FEATURES, _SET_MODE_RANGE, _SET_MIXER, _SET_SERVO_RULE = 36, 37, 35, 0x2011, 0x2021
_GPS = 1 << 7
#: HITL_ENABLE, HITL_MUTE_BEEPER, HITL_HAS_NEW_GPS_DATA.
_FLAGS, _NEW_GPS = 1 | 1 << 2, 1 << 4
_STEP_S, _GPS_EVERY = 0.01, 10
_HOVER, _G = 300, 9.80665
#: Degrees/s2 for one unit of output, and the drag of the air, 1/s.
_TURN, _DRAG = 12.0, 0.25
ARM, ANGLE, NAV_WP = 0, 1, 28
#: Of versions before 9.
_FIXED_PORT = 5760
_CHANNELS = {ARM: 4, ANGLE: 5, NAV_WP: 6}


class Sitl:
    """One INAV on the field at LAT_E7, LON_E7."""

    def __init__(self, binary: Path, folder: Path, port: int) -> None:
        told = subprocess.run([binary, "--help"], capture_output=True, text=True, check=False)
        has_port = "--tcpbaseport" in told.stdout + told.stderr
        self._port = port if has_port else _FIXED_PORT
        command = [str(binary), f"--path={folder / 'eeprom.bin'}", *[f"--tcpbaseport={port}"] * has_port]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
        self._socket: socket.socket | None = None
        self._parser = MspParser()
        self.place = [0.0, 0.0, 0.0]
        self.velocity = [0.0, 0.0, 0.0]
        #: Roll, pitch (nose down) and heading, degrees.
        self.attitude = [0.0, 0.0, 0.0]
        self._rates = [0.0, 0.0, 0.0]
        self._outputs = (0, 0, 0, -500)
        self.channels = [1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000]
        self._steps = 0
        self._connect()

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._process.terminate()
        self._process.wait(5)

    def _connect(self) -> None:
        deadline = time.monotonic() + 20
        while True:
            if self._socket is not None:
                self._socket.close()
            with suppress(OSError):
                self._socket = socket.create_connection(("127.0.0.1", self._port), 2)
                self._socket.settimeout(2.0)
                self._parser = MspParser()
                self.ask(Msp.API_VERSION)
                return
            assert time.monotonic() < deadline, "the SITL does not answer"
            time.sleep(0.2)

    def ask(self, command: int, payload: bytes = b"") -> MspFrame:
        assert self._socket is not None
        self._socket.sendall(request(command, payload))
        while True:
            data = self._socket.recv(4096)
            if not data:
                raise ConnectionError
            for frame in self._parser.feed(data):
                if frame.command == command:
                    return frame

    def set(self, name: str, value: float | str) -> None:
        info = decode_setting_info(self.ask(COMMON_SETTING_INFO, encode_about_name(name)).payload)
        assert info is not None, name
        if isinstance(value, str) and info.choices:
            value = info.minimum + info.choices.index(value)
        reply = self.ask(COMMON_SET_SETTING, encode_about_name(name) + pack_value(info.type, value))
        assert reply.direction is Direction.REPLY, name

    def configure(self, platform: int = 0, zones: Sequence[Geozone] = (), **settings: float | str) -> None:
        """Set it up, save, and restart it. platform: INAV's number."""
        for name, value in {"receiver_type": "MSP", "gps_provider": "FAKE", **settings}.items():
            self.set(name, value)
        features = int.from_bytes(self.ask(_FEATURES).payload[:4], "little") | _GPS
        features = features | GEOZONE_FEATURE if zones else features & ~GEOZONE_FEATURE
        self.ask(_SET_FEATURES, features.to_bytes(4, "little"))
        for slot, (box, channel) in enumerate(_CHANNELS.items()):
            self.ask(_SET_MODE_RANGE, bytes((slot, box, channel - 4, 32, 48)))
        self.ask(_SET_MIXER, struct.pack("<BBBBhBB", 0, 0, 0, platform, -1, 4, 4))
        self.ask(_SET_SERVO_RULE, struct.pack("<BBBhBB", 0, 1, 0, 100, 0, 0xFF))
        for zone in zones:
            if self.ask(SET_GEOZONE, zone.head()).direction is Direction.ERROR:
                pytest.skip("INAV before 8.0 has no geozones")
            for number in range(len(zone.corners)):
                self.ask(SET_GEOZONE_VERTEX, zone.vertex(number))
        self.ask(_SAVE)
        self.ask(_REBOOT)
        time.sleep(1)
        self._connect()
        # Its gyro calibrates before the craft around it begins.
        time.sleep(4)

    def write(self, records: Sequence[NavRecord]) -> None:
        for number, record in enumerate(records, 1):
            assert self._socket is not None
            self._socket.sendall(encode_set_wp(number, record))
            while not any(frame.command == Nav.SET_WP for frame in self._parser.feed(self._socket.recv(4096))):
                pass

    def switch(self, *boxes: int) -> None:
        for box, channel in _CHANNELS.items():
            self.channels[channel] = 1800 if box in boxes else 1000

    def run(self, seconds: float) -> None:
        """In real time."""
        end = time.monotonic() + seconds
        due = time.monotonic()
        while due < end:
            self._step()
            due += _STEP_S
            time.sleep(max(due - time.monotonic(), 0.0))

    def blockers(self) -> tuple[str, ...]:
        status = decode_inav_status(self.ask(Msp.INAV_STATUS).payload)
        assert status is not None
        return status.blockers

    def is_armed(self) -> bool:
        status = decode_inav_status(self.ask(Msp.INAV_STATUS).payload)
        assert status is not None
        return bool(status.box_flags & 1)

    def nav_status(self) -> NavStatus:
        status = decode_nav_status(self.ask(Msp.NAV_STATUS).payload)
        assert status is not None
        return status

    @property
    def speed_m_s(self) -> float:
        return hypot(*self.velocity[:2])

    def _step(self) -> None:
        roll, pitch, yaw, throttle = self._outputs
        push = self._fly(roll, pitch, yaw, throttle + 500)
        self._steps += 1
        has_gps = self._steps % _GPS_EVERY == 0
        north, west, up = self.place
        to_north, to_west, climb = self.velocity
        course = round(degrees(atan2(-to_west, to_north)) * 10) % 3600
        gps = struct.pack(
            "<BBiiiHHhhh",
            2,
            15,
            LAT_E7 + round(north * _E7_PER_M),
            LON_E7 - round(west * _E7_PER_M_EAST),
            round((_FIELD_M + up) * 100),
            round(self.speed_m_s * 100),
            course,
            round(to_north * 100),
            round(-to_west * 100),
            round(-climb * 100),
        )
        attitude = struct.pack(
            "<hhh", *(round(each * 10) for each in self.attitude[:2]), round(self.attitude[2] * 10) % 3600
        )
        sensors = struct.pack("<hhh", *(round(each / _G * 1000) for each in push))
        sensors += struct.pack("<hhh", *(round(min(max(each * 16, -32000), 32000)) for each in self._rates))
        pressure = round(101325 * (1 - 2.25577e-5 * (_FIELD_M + up)) ** 5.25588)
        heading = radians(self.attitude[2])
        magnet = struct.pack("<hhh", round(16000 * cos(heading)), round(16000 * sin(heading)), 0)
        flags = _FLAGS | (_NEW_GPS if has_gps else 0)
        reply = self.ask(
            _SIMULATOR, bytes((2, flags)) + gps + attitude + sensors + struct.pack("<i", pressure) + magnet
        )
        self._outputs = struct.unpack_from("<hhhh", reply.payload)
        if self._steps % 2:
            self.ask(_RAW_RC, struct.pack("<8H", *self.channels))

    def _fly(self, roll: int, pitch: int, yaw: int, throttle: int) -> tuple[float, float, float]:
        """Advance by a step; the specific force, body axes."""
        if self.place[2] <= 0 and throttle < _HOVER:
            self.velocity, self._rates = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            self.place[2] = 0.0
            self.attitude[:2] = [0.0, 0.0]
            return (0.0, 0.0, _G)
        for axis, output in enumerate((roll, pitch, yaw)):
            self._rates[axis] += (output * _TURN - 2 * self._rates[axis]) * _STEP_S
        for axis in (0, 1):
            self.attitude[axis] += self._rates[axis] * _STEP_S
        self.attitude[2] = (self.attitude[2] - self._rates[2] * _STEP_S) % 360
        phi, theta, psi = radians(self.attitude[0]), radians(self.attitude[1]), -radians(self.attitude[2])
        thrust = _G * max(throttle, 0) / _HOVER
        # Up in world axes: yaw, then pitch, then roll.
        ahead = cos(phi) * sin(theta)
        aside = -sin(phi)
        up = cos(phi) * cos(theta)
        push = (
            thrust * (ahead * cos(psi) - aside * sin(psi)),
            thrust * (ahead * sin(psi) + aside * cos(psi)),
            thrust * up,
        )
        drag = [-_DRAG * each for each in self.velocity]
        for axis in range(3):
            self.velocity[axis] += (push[axis] + drag[axis] - (_G if axis == 2 else 0.0)) * _STEP_S
            self.place[axis] += self.velocity[axis] * _STEP_S
        # The drag is felt along and across.
        felt = drag[0] * cos(psi) + drag[1] * sin(psi), -drag[0] * sin(psi) + drag[1] * cos(psi)
        return felt[0] * cos(theta), felt[1] * cos(phi), thrust
