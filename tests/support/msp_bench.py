# SPDX-License-Identifier: GPL-3.0-or-later
"""A test bench: a simulated board other than a Naze, a client on its port, and a clock moved only by the test."""

import struct
from dataclasses import replace
from functools import reduce
from operator import xor
from typing import NamedTuple

from protocols.msp.frame import Direction, MspParser, request
from protocols.msp.inav_places import GEOZONE_FEATURE, SET_GEOZONE, SET_GEOZONE_VERTEX, Geozone
from protocols.msp.inav_settings import COMMON_SET_SETTING
from protocols.msp.nav import NavAction
from simulator.board.msp_board import MspBoard
from simulator.board.msp_options import MspOptions
from simulator.board.nav_waypoint import FLAG_LAST, NavWaypoint, unpack_waypoint
from simulator.board.options import Faults
from simulator.commands.fc_kinds import make_board

SET_WP, WP, GETINFO, SAVE, LOAD = 209, 118, 20, 19, 18


class Frame(NamedTuple):
    """A reply; `direction` is '>' or '!'."""

    direction: str
    command: int
    payload: bytes


class MspBench:
    """A board that has just booted at time 0. `received` has all bytes received from it."""

    def __init__(
        self, kind: str, options: MspOptions | None = None, faults: Faults | None = None, eeprom: bytes | None = None
    ) -> None:
        self.board = make_board(kind, options, faults, None if eeprom is None else memoryview(bytearray(eeprom)))
        self.board.power_on_booted(0.0)
        self.board.advance(0.0)
        self.now = 0.0
        self.received = bytearray()

    @property
    def faults(self) -> Faults:
        return self.board.faults

    def send(self, data: bytes) -> None:
        self.board.receive(data, self.now)

    def run(self, seconds: float) -> bytes:
        """Let time pass; return the received bytes."""
        end, before = self.now + seconds, len(self.received)
        while self.now < end:
            self._step(end)
        return bytes(self.received[before:])

    def ask(self, command: int, payload: bytes = b"", timeout: float = 0.5) -> Frame | None:
        """Send a request and return the next frame; None after `timeout` seconds."""
        before, end = len(self.received), self.now + timeout
        self.send(request(command, payload))
        while self.now < end:
            self._step(end)
            frames = split_frames(bytes(self.received[before:]))
            if frames:
                return frames[0]
        return None

    def payload(self, command: int, payload: bytes = b"") -> bytes:
        """The payload of a reply, which must not be an error."""
        frame = self.ask(command, payload)
        assert frame is not None
        assert (frame.direction, frame.command) == (">", command)
        return frame.payload

    def payload_v2(self, command: int, payload: bytes = b"") -> bytes:
        """The payload of an MSP v2 reply."""
        self.send(request(command, payload))
        (frame,) = MspParser().feed(self.run(0.2))
        assert (frame.direction, frame.command) == (Direction.REPLY, command)
        return frame.payload

    def write(self, number: int, waypoint: NavWaypoint) -> None:
        assert self.payload(SET_WP, waypoint.pack(number)) == b""

    def read(self, number: int) -> NavWaypoint:
        found, waypoint = unpack_waypoint(self.payload(WP, bytes((number,))))
        assert found == number
        return waypoint

    def info(self) -> tuple[int, bool, int]:
        """The mission's capacity, validity and count."""
        _, capacity, valid, count = self.payload(GETINFO)
        return capacity, bool(valid), count

    def upload(self, waypoints: list[NavWaypoint]) -> None:
        """Write a list one record at a time, the last with its flag."""
        for number, waypoint in enumerate(waypoints, 1):
            self.write(number, replace(waypoint, flag=FLAG_LAST if number == len(waypoints) else waypoint.flag))

    def set(self, setting: str, value: int) -> None:
        """Set one of INAV's 16-bit settings."""
        assert self.payload_v2(COMMON_SET_SETTING, setting.encode() + b"\0" + value.to_bytes(2, "little")) == b""

    def restart(self) -> None:
        self.board.power_off(self.now)
        self.board.power_on_booted(self.now)
        self.run(0.01)

    def _step(self, end: float) -> None:
        self.now = min(max(self.board.next_wakeup(self.now), self.now + 1e-6), end)
        self.received += self.board.advance(self.now)


def split_frames(data: bytes) -> list[Frame]:
    """The complete frames, jumbo frames included; all must be intact."""
    frames = []
    while len(data) >= 6:
        assert data[:2] == b"$M", data.hex()
        size, body = data[3], 5
        if size == 255:
            size, body = int.from_bytes(data[5:7], "little"), 7
        if len(data) <= body + size:
            break
        assert reduce(xor, data[3 : body + size + 1]) == 0
        frames.append(Frame(chr(data[2]), data[4], data[body : body + size]))
        data = data[body + size + 1 :]
    return frames


def waypoint(index: int = 0, action: int = NavAction.WAYPOINT, **fields: int) -> NavWaypoint:
    """A waypoint near the field, different for each index."""
    usual = {"lat_e7": 453838000 + 900 * index, "lon_e7": 84733000 + 700 * (index % 7), "alt_cm": 2000, "flag": 0}
    return NavWaypoint(action, **usual | fields)


def set_zone(board: MspBoard, zone: Geozone) -> None:
    """A geozone of one place, in force since the boot."""
    places = board._firmware._places  # type: ignore[union-attr]
    places._features |= GEOZONE_FEATURE
    assert places.answer(SET_GEOZONE, zone.head()) == places.answer(SET_GEOZONE_VERTEX, zone.vertex(0)) == b""
    places._zones_in_force = [*places._zones]
    places._vertices_in_force = [struct.unpack("<bBii", vertex) for vertex in places._vertices if vertex[0] != 0xFF]
