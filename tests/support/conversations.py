# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station's upload and download, with its own repeats."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.harakiri.check import HarakiriRules
from bridge.missions.list_check import check_list
from protocols.mavlink.codec import item_from_float_message, item_from_int_message
from protocols.mavlink.dialect import Message
from protocols.mission_item import Command, Frame, MissionItem, MissionResult, degrees_to_e7
from protocols.msp.mission import WpRecord
from tests.support.world import GroundStation

MISSION = 0
_LAT_E7, _LON_E7 = 453838000, 84733000


def waypoints(count: int, seed: int = 0) -> list[MissionItem]:
    """Home and `count - 1` waypoints that are stored unchanged; each `seed` gives a different list."""
    return [
        MissionItem(
            seq=number,
            command=Command.NAV_WAYPOINT,
            frame=Frame.GLOBAL_RELATIVE_ALT if number else Frame.GLOBAL,
            p1=0.0,
            p2=2.0,
            p3=0.0,
            p4=0.0,
            lat_e7=_LAT_E7 + 1000 * seed + 37 * number,
            lon_e7=_LON_E7 - 91 * number - seed,
            alt_m=20.0 + number % 50,
        )
        for number in range(count)
    ]


def records_of(items: Sequence[MissionItem]) -> tuple[WpRecord, ...]:
    """The records of them that the flight controller must hold."""
    return check_list(items, HarakiriRules()).records


def rounded(items: Sequence[MissionItem]) -> list[MissionItem]:
    """The items as MISSION_ITEM carries them: degrees in single precision."""

    def single(degrees_e7: int | None) -> int | None:
        (degrees,) = struct.unpack("<f", struct.pack("<f", (degrees_e7 or 0) / 1e7))
        return degrees_to_e7(degrees)

    return [replace(item, lat_e7=single(item.lat_e7), lon_e7=single(item.lon_e7)) for item in items]


def count_message(count: int, mission_type: int = MISSION) -> Message:
    return messages.MAVLink_mission_count_message(1, 1, count, mission_type)


def clear_message(mission_type: int = MISSION) -> Message:
    return messages.MAVLink_mission_clear_all_message(1, 1, mission_type)


def ack_message(result: int, mission_type: int = MISSION) -> Message:
    return messages.MAVLink_mission_ack_message(1, 1, result, mission_type)


def list_message(mission_type: int = MISSION) -> Message:
    return messages.MAVLink_mission_request_list_message(1, 1, mission_type)


def request_message(seq: int, *, as_int: bool = True, mission_type: int = MISSION) -> Message:
    make = messages.MAVLink_mission_request_int_message if as_int else messages.MAVLink_mission_request_message
    return make(1, 1, seq, mission_type)


def item_message(seq: int, sent: MissionItem, *, as_int: bool = True, mission_type: int = MISSION) -> Message:
    make = messages.MAVLink_mission_item_int_message if as_int else messages.MAVLink_mission_item_message
    lat, lon = sent.lat_e7 or 0, sent.lon_e7 or 0
    x, y = (lat, lon) if as_int else (lat / 1e7, lon / 1e7)
    params = (sent.p1, sent.p2, sent.p3, sent.p4)
    return make(1, 1, seq, sent.frame, sent.command, 0, 1, *params, x, y, sent.alt_m, mission_type)


class Transfer:
    """A ground station's end of a transfer: it repeats its last message while it waits, at most `tries` times."""

    def __init__(self, station: GroundStation, *, as_int: bool, repeat_s: float, tries: int, mission_type: int) -> None:
        self.station, self.as_int = station, as_int
        self.result: MissionResult | None = None
        self.gave_up = False
        self._repeat_s, self._tries, self._type = repeat_s, tries, mission_type
        self._turn = 0
        station.on_message.append(self._react)

    @property
    def is_over(self) -> bool:
        return self.result is not None or self.gave_up

    def stop(self) -> None:
        """Fall silent forever, like a crashed ground station."""
        self.gave_up = True

    def _react(self, message: Message) -> None:
        is_ours = self.station.is_target_of(message) and getattr(message, "mission_type", MISSION) == self._type
        if is_ours and not self.is_over:
            self._received(message)

    def _received(self, message: Message) -> None:
        raise NotImplementedError

    def _send(self, what: Callable[[], None]) -> None:
        self._turn += 1
        self._repeat(what, self._turn, 0)

    def _repeat(self, what: Callable[[], None], turn: int, silent: int) -> None:
        if self.is_over or turn != self._turn:
            return
        if silent > self._tries:
            self.gave_up = True
            return
        what()
        self.station.world.after(self._repeat_s, lambda: self._repeat(what, turn, silent + 1))


class Upload(Transfer):
    """A ground station that uploads a mission: it answers each request."""

    def __init__(
        self,
        station: GroundStation,
        items: Sequence[MissionItem],
        *,
        as_int: bool = True,
        repeat_s: float = 0.45,
        tries: int = 11,
        mission_type: int = MISSION,
    ) -> None:
        super().__init__(station, as_int=as_int, repeat_s=repeat_s, tries=tries, mission_type=mission_type)
        self.items = list(items)
        self.requested: list[int] = []
        self._send(lambda: self.station.send(count_message(len(self.items), self._type)))

    def run(self, seconds: float = 60.0) -> MissionResult | None:
        """Run the world until the upload has ended."""
        self.station.world.run_until(lambda _: self.is_over, seconds)
        return self.result

    def _item(self, seq: int) -> None:
        self.station.send(item_message(seq, self.items[seq], as_int=self.as_int, mission_type=self._type))

    def _received(self, message: Message) -> None:
        match message.get_type():
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                self.requested.append(message.seq)
                self._send(partial(self._item, message.seq))
            case "MISSION_ACK":
                self.result = MissionResult(message.type)


class Download(Transfer):
    """A ground station that downloads the mission."""

    def __init__(
        self,
        station: GroundStation,
        *,
        as_int: bool = True,
        repeat_s: float = 0.7,
        tries: int = 7,
        mission_type: int = MISSION,
    ) -> None:
        super().__init__(station, as_int=as_int, repeat_s=repeat_s, tries=tries, mission_type=mission_type)
        self.count: int | None = None
        self.items: list[MissionItem] = []
        self._send(self._ask)

    @property
    def is_over(self) -> bool:
        return super().is_over or self.count == len(self.items)

    def run(self, seconds: float = 60.0) -> list[MissionItem]:
        self.station.world.run_until(lambda _: self.is_over, seconds)
        return self.items

    def _ask(self) -> None:
        if self.count is None:
            self.station.send(list_message(self._type))
        else:
            self.station.send(request_message(len(self.items), as_int=self.as_int, mission_type=self._type))

    def _received(self, message: Message) -> None:
        match message.get_type():
            case "MISSION_COUNT" if self.count is None:
                self.count = message.count
            case "MISSION_ITEM_INT" if self.as_int and message.seq == len(self.items):
                self.items.append(item_from_int_message(message))
            case "MISSION_ITEM" if not self.as_int and message.seq == len(self.items):
                self.items.append(item_from_float_message(message))
            case "MISSION_ACK" if message.type != MissionResult.ACCEPTED:
                self.result = MissionResult(message.type)
            case _:
                return
        if not self.is_over:
            self._send(self._ask)
        elif self.result is None:
            self.station.send(ack_message(MissionResult.ACCEPTED, self._type))
