# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own SITL (a path in INAV_SITL) with a craft around it, over MSP: its HITL interface (fc_msp.c, MSP_SIMULATOR).

The craft is a rigid body without inertia: rates follow INAV's stabilising outputs, thrust its throttle. Body axes are
forward, left and up, world axes north, west and up. INAV's clock is that of the physics (inav_clock.c).
"""

import mmap
import os
import select
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
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
from protocols.msp.nav import LAST, Nav, NavRecord, NavStatus, decode_nav_status, encode_set_wp

LAT_E7, LON_E7 = 453_838_000, 84_733_000
_E7_PER_M, _E7_PER_M_EAST = 1e7 / 111_195, 1e7 / 78_100
_FIELD_M = 131.0
_SIMULATOR, _RAW_RC, _REBOOT, _SAVE = 0x201F, 200, 68, 250
_FEATURES, _SET_FEATURES, _SET_MODE_RANGE, _SET_MIXER, _SET_SERVO_RULE = 36, 37, 35, 0x2011, 0x2021
_GPS = 1 << 7
#: HITL_ENABLE, HITL_MUTE_BEEPER, HITL_HAS_NEW_GPS_DATA.
_FLAGS, _NEW_GPS = 1 | 1 << 2, 1 << 4
#: A step takes as long as INAV's reply: its serial task runs 100 times a second.
_STEP_S, _LONGEST_STEP_S, _GPS_S, _RC_S = 0.01, 0.1, 0.1, 0.05
#: INAV's time between two looks for the reply, and the time of this machine until it is given up.
_WAIT_S, _LONGEST_WAIT_S = 0.002, 30
#: INAV's serial task has its turn within this many of them.
_USUAL_PASSES = 6
_HOVER, _G = 300, 9.80665
#: Degrees/s2 for one unit of output, and the drag of the air, 1/s.
_TURN, _DRAG = 12.0, 0.25
ARM, ANGLE, NAV_WP = 0, 1, 28
#: Of versions before 9.
_FIXED_PORT = 5760
_THROTTLE = 2
_CHANNELS = {ARM: 4, ANGLE: 5, NAV_WP: 6}


class Clock:
    """INAV's clock, in a file that both processes map: the time, and its limit, microseconds."""

    def __init__(self, folder: Path) -> None:
        library, file = folder / "inav_clock.so", folder / "clock"
        source = Path(__file__).parent / "inav_clock.c"
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", library, source], check=True)
        file.write_bytes(bytes(16))
        with file.open("r+b") as opened:
            self._shared = mmap.mmap(opened.fileno(), 16)
        self.environment = {**os.environ, "LD_PRELOAD": str(library), "INAV_CLOCK": str(file)}

    @property
    def now_s(self) -> float:
        return int.from_bytes(self._shared[:8], "little") / 1e6

    @property
    def is_at_limit(self) -> bool:
        return self.now_s >= self._limit_s

    @property
    def _limit_s(self) -> float:
        return int.from_bytes(self._shared[8:], "little") / 1e6

    def let_pass(self, seconds: float) -> None:
        self._shared[8:] = round((self.now_s + seconds) * 1e6).to_bytes(8, "little")

    def run(self, seconds: float) -> None:
        """Let the time pass."""
        self.let_pass(seconds)
        while not self.is_at_limit:
            time.sleep(0.0002)


class Sitl:
    """One INAV on the field at LAT_E7, LON_E7."""

    def __init__(self, binary: Path, folder: Path, port: int) -> None:
        told = subprocess.run([binary, "--help"], capture_output=True, text=True, check=False)
        has_port = "--tcpbaseport" in told.stdout + told.stderr
        self._port = port if has_port else _FIXED_PORT
        command = [str(binary), f"--path={folder / 'eeprom.bin'}", *[f"--tcpbaseport={port}"] * has_port]
        self._clock = Clock(folder)
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder, env=self._clock.environment
        )
        self._socket: socket.socket | None = None
        self._parser = MspParser()
        self.place = [0.0, 0.0, 0.0]
        self.velocity = [0.0, 0.0, 0.0]
        #: Roll, pitch (nose down) and heading, degrees.
        self.attitude = [0.0, 0.0, 0.0]
        self._rates = [0.0, 0.0, 0.0]
        self._outputs = (0, 0, 0, -500)
        self.channels = [1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000]
        self._last_step = self._last_gps = self._last_rc = 0.0
        self._connect()

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._process.terminate()
        self._process.wait(5)

    def line(self) -> str:
        """Disconnect from it. Returns the line for a daemon. INAV's clock then goes like this machine's."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        threading.Thread(target=self._keep_time, daemon=True).start()
        return f"tcp:127.0.0.1:{self._port}"

    def _keep_time(self) -> None:
        while self._process.poll() is None:
            self._clock.let_pass(_STEP_S)
            time.sleep(_STEP_S)

    def _connect(self) -> None:
        deadline = time.monotonic() + 60
        while True:
            if self._socket is not None:
                self._socket.close()
            with suppress(OSError):
                self._socket = socket.create_connection(("127.0.0.1", self._port), 2)
                self._parser = MspParser()
                self.ask(Msp.API_VERSION)
                return
            assert time.monotonic() < deadline, "the SITL does not answer"
            self._clock.let_pass(0.1)
            time.sleep(0.05)

    def ask(self, command: int, payload: bytes = b"") -> MspFrame:
        return self._exchange(request(command, payload), command)

    def _exchange(self, frame: bytes, command: int) -> MspFrame:
        assert self._socket is not None
        self._socket.sendall(frame)
        deadline, passes = time.monotonic() + _LONGEST_WAIT_S, 0
        while time.monotonic() < deadline:
            # On a busy machine the SITL's receiver is late: its clock must not run on meanwhile.
            if not select.select([self._socket], [], [], 0.0002 if passes < _USUAL_PASSES else 0.01)[0]:
                if self._clock.is_at_limit:
                    self._clock.let_pass(_WAIT_S)
                    passes += 1
                continue
            if not (data := self._socket.recv(4096)):
                raise ConnectionError
            for reply in self._parser.feed(data):
                if reply.command == command:
                    return reply
        raise TimeoutError

    def set(self, name: str, value: float | str) -> None:
        info = decode_setting_info(self.ask(COMMON_SETTING_INFO, encode_about_name(name)).payload)
        assert info is not None, name
        if isinstance(value, str) and info.choices:
            value = info.minimum + info.choices.index(value)
        reply = self.ask(COMMON_SET_SETTING, encode_about_name(name) + pack_value(info.type, value))
        assert reply.direction is Direction.REPLY, name

    def configure(self, platform: int = 0, zones: Sequence[Geozone] = (), **settings: float | str) -> None:
        """Set it up, save, and restart it. platform: INAV's number."""
        # INAV 6 does not take the accelerometer of HITL for calibrated.
        usual: dict[str, float | str] = {"receiver_type": "MSP", "gps_provider": "FAKE", "acczero_x": 1}
        for name, value in {**usual, **settings}.items():
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
        self._connect()
        # Its gyro calibrates before the craft around it begins.
        self._clock.run(5)

    def write(self, records: Sequence[NavRecord]) -> None:
        for number, record in enumerate(records, 1):
            self._exchange(encode_set_wp(number, record), Nav.SET_WP)

    def fly(self, records: Sequence[NavRecord], *switches: int, throttle_us: int = 1500) -> None:
        """Write the list, arm, and turn NAV WP on."""
        self.run(4)
        self.write([*records[:-1], replace(records[-1], flag=LAST)])
        self.run(1)
        self.switch(ARM, *switches)
        self.run(1)
        assert self.is_armed(), self.blockers()
        self.channels[_THROTTLE] = throttle_us
        self.switch(ARM, NAV_WP, *switches)

    def switch(self, *boxes: int) -> None:
        for box, channel in _CHANNELS.items():
            self.channels[channel] = 1800 if box in boxes else 1000

    def run(self, seconds: float) -> None:
        """Fly on, in INAV's time."""
        end_s = self._clock.now_s + seconds
        while (now_s := self._clock.now_s) < end_s:
            self._step(now_s, min(now_s - self._last_step, _LONGEST_STEP_S))
            self._last_step = now_s
            if (rest_s := now_s + _STEP_S - self._clock.now_s) > 0:
                self._clock.run(rest_s)

    @property
    def now_s(self) -> float:
        return self._clock.now_s

    @property
    def version(self) -> tuple[int, int, int]:
        major, minor, patch = self.ask(Msp.FC_VERSION).payload[:3]
        return major, minor, patch

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

    def _step(self, now: float, step_s: float) -> None:
        roll, pitch, yaw, throttle = self._outputs
        push = self._fly(roll, pitch, yaw, throttle + 500, step_s)
        has_gps = now - self._last_gps >= _GPS_S
        if has_gps:
            self._last_gps = now
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
        if now - self._last_rc >= _RC_S:
            self._last_rc = now
            self.ask(_RAW_RC, struct.pack("<8H", *self.channels))

    def _fly(self, roll: int, pitch: int, yaw: int, throttle: int, step_s: float) -> tuple[float, float, float]:
        """Advance by a step; the specific force, body axes."""
        if self.place[2] <= 0 and throttle < _HOVER:
            self.velocity, self._rates = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            self.place[2] = 0.0
            self.attitude[:2] = [0.0, 0.0]
            return (0.0, 0.0, _G)
        for axis, output in enumerate((roll, pitch, yaw)):
            self._rates[axis] += (output * _TURN - 2 * self._rates[axis]) * step_s
        for axis in (0, 1):
            self.attitude[axis] += self._rates[axis] * step_s
        self.attitude[2] = (self.attitude[2] - self._rates[2] * step_s) % 360
        phi, theta, psi = radians(self.attitude[0]), radians(self.attitude[1]), -radians(self.attitude[2])
        thrust = _G * max(throttle, 0) / _HOVER
        # Forward, left and up in world axes: yaw, then pitch, then roll.
        body = tuple(
            (ahead * cos(psi) - aside * sin(psi), ahead * sin(psi) + aside * cos(psi), up)
            for ahead, aside, up in (
                (cos(theta), 0.0, -sin(theta)),
                (sin(phi) * sin(theta), cos(phi), sin(phi) * cos(theta)),
                (cos(phi) * sin(theta), -sin(phi), cos(phi) * cos(theta)),
            )
        )
        drag = [-_DRAG * each for each in self.velocity]
        for axis in range(3):
            self.velocity[axis] += (thrust * body[2][axis] + drag[axis] - (_G if axis == 2 else 0.0)) * step_s
            self.place[axis] += self.velocity[axis] * step_s
        ahead, aside, up = (sum(one * other for one, other in zip(axis, drag, strict=True)) for axis in body)
        return ahead, aside, up + thrust
