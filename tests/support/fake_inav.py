# SPDX-License-Identifier: GPL-3.0-or-later
"""A minimal INAV or MultiWii NAV as a `peer` of the world, for misbehaviour and losses.

Real behaviour is in simulator/.
"""

import random
import struct
from collections.abc import Callable

from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.msp.nav import LAST, Nav, NavAction
from tests.support.fake_controllers import MspFake, ident

KNOWN = frozenset(NavAction) - {NavAction.POSHOLD_UNLIM}
FAKE = bytes((NavAction.RTH, *bytes(18), LAST))
HOME = struct.pack("<ii", 453838000, 84733000)


class FakeInav(MspFake):
    """An INAV; `records` has the 20 bytes of each record. `drop(frame)`: this request or its reply is lost."""

    def __init__(self, capacity: int = 120, drop: Callable[[MspFrame], str] = lambda _frame: "") -> None:
        super().__init__({1: b"\0\2\5", 2: b"INAV", 119: bytes((0, 51, 1, 2, 10, 28))})
        self.capacity = capacity
        self.records: list[bytes] = []
        self.saved: list[bytes] | None = None
        self.is_valid = False
        self.armed = False
        self.writes = self.saves = 0
        self.drop = drop
        #: True for a record that it acknowledges and does not store.
        self.ignores: Callable[[bytes], bool] = lambda _record: False
        self.nav = (0, 0, 0, 0, 0, 0)
        self.commands: list[int] = []
        self._frames = MspParser()

    def power_off(self, now: float) -> None:
        """RAM is lost. The saved list is not loaded at boot; only the pilot's LOAD does that."""
        self.records, self.is_valid = [], False

    def receive(self, data: bytes, now: float) -> None:
        for frame in self._frames.feed(data):
            lost = self.drop(frame)
            if lost == "request":
                continue
            self.commands.append(frame.command)
            answer = self.answer(frame)
            if lost != "reply":
                direction = Direction.ERROR if answer is None else Direction.REPLY
                self.outgoing += MspFrame(direction, frame.command, answer or b"").encode()

    def answer(self, frame: MspFrame) -> bytes | None:
        """Handle a request; None: an error."""
        match frame.command:
            case 101:
                return bytes(6) + int(self.armed).to_bytes(4, "little") + b"\0"
            case 121:
                return struct.pack("<BBBBBH", *self.nav)
            case Nav.GETINFO:
                return bytes((0, self.capacity, self.is_valid, len(self.records)))
            case Nav.SET_WP:
                self.writes += frame.payload[0] <= self.capacity
                if not self.ignores(frame.payload[1:]):
                    self.store(frame.payload[0], frame.payload[1:])
                return b""
            case Nav.WP:
                return bytes((frame.payload[0],)) + self.read(frame.payload[0])
            case Nav.SAVE:
                return self.save()
        return self.answers.get(frame.command)

    def store(self, number: int, record: bytes) -> None:
        if record[0] not in KNOWN or not 1 <= number <= self.capacity:
            return
        if number == 1:
            self.records = []
        if number == len(self.records) + 1:
            self.records.append(record)
            self.is_valid = record[-1] == LAST

    def read(self, number: int) -> bytes:
        if number == 0:
            return b"\4" + HOME + bytes(10) + bytes((LAST,))
        return self.records[number - 1] if number <= len(self.records) else FAKE

    def save(self) -> bytes | None:
        if self.armed or not self.is_valid:
            return None
        self.saves += 1
        self.saved = list(self.records)
        return b""


class FakeMultiwii(FakeInav):
    """A MultiWii 2.4.1 with NAV: each record is stored separately, and there is no SAVE."""

    erased = bytes(19) + b"\xfe"

    def __init__(self, capacity: int = 60, drop: Callable[[MspFrame], str] = lambda _frame: "") -> None:
        super().__init__(capacity, drop)
        self.answers = {100: ident(241, 1 << 4), 116: b"ANGLE;ARM;MISSION;", 122: nav_config(capacity)}
        self.places: dict[int, bytes] = {}

    def answer(self, frame: MspFrame) -> bytes | None:
        if frame.command in (Nav.GETINFO, Nav.SAVE, 2):
            return None
        if frame.command == 101:
            return bytes(6) + (int(self.armed) << 1).to_bytes(4, "little") + b"\0"
        return super().answer(frame)

    def store(self, number: int, record: bytes) -> None:
        if 1 <= number <= self.capacity:
            self.places[number] = record

    def read(self, number: int) -> bytes:
        return self.places.get(number, self.erased) if number else super().read(0)

    @property
    def flown(self) -> list[bytes]:
        """The list that it would fly: the records up to the flag LAST."""
        flown: list[bytes] = []
        for number in range(1, self.capacity + 1):
            if number not in self.places:
                return flown
            flown.append(self.places[number])
            if flown[-1][-1] == LAST:
                break
        return flown


def nav_config(capacity: int, safe_wp_distance: int = 500, nav_max_altitude: int = 100, wp_radius: int = 200) -> bytes:
    """MSP_NAV_CONFIG; the radius is in cm, the others in m."""
    return struct.pack("<2xHHH12xBx", wp_radius, safe_wp_distance, nav_max_altitude, capacity)


def lossy(rate: float, seed: int) -> Callable[[MspFrame], str]:
    draw = random.Random(seed)
    return lambda _frame: draw.choice(("request", "reply")) if draw.random() < rate else ""
