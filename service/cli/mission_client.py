# SPDX-License-Identifier: GPL-3.0-or-later
"""The demonstration's ground station: pymavlink's mavutil, so that the mission is written by code not ours."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from typing import Any

from protocols.mavlink.codec import item_from_int_message
from protocols.mission_item import MissionItem, MissionResult

_HEARTBEAT_INTERVAL_S = 0.2
_REPLY_TIMEOUT_S = 1.0
_TRIES = 8
_REQUESTS = ("MISSION_REQUEST", "MISSION_REQUEST_INT")


class ClientError(Exception):
    """The vehicle did not carry out a request; one sentence."""


class MissionClient:
    """A connection to one vehicle (mavutil.mavfile). `texts` collects received STATUSTEXTs."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection
        self.texts: list[str] = []

    def connect(self, timeout_s: float) -> bool:
        """Wait for the heartbeat of a vehicle with a flight controller; False if none arrives in time."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            self._connection.mav.heartbeat_send(6, 8, 0, 0, 4)  # a ground station
            heartbeat = self._connection.wait_heartbeat(timeout=_HEARTBEAT_INTERVAL_S)
            if heartbeat is not None and heartbeat.system_status:
                return True
        return False

    def write(self, items: Sequence[MissionItem], progress: Callable[[int], None]) -> MissionResult:
        """Upload a list; returns the type of the final MISSION_ACK."""
        answer = self._ask(lambda mav, *target: mav.mission_count_send(*target, len(items)), *_REQUESTS, "MISSION_ACK")
        while answer.get_type() in _REQUESTS:
            progress(answer.seq)
            item = items[answer.seq]
            fields = item.seq, item.frame, item.command, 0, 1, item.p1, item.p2, item.p3, item.p4
            place = item.lat_e7 or 0, item.lon_e7 or 0, item.alt_m
            answer = self._ask(
                lambda mav, *target, fields=fields, place=place: mav.mission_item_int_send(*target, *fields, *place),
                *_REQUESTS,
                "MISSION_ACK",
            )
        progress(len(items))
        return MissionResult(answer.type)

    def read(self) -> list[MissionItem]:
        count = self._ask(lambda mav, *target: mav.mission_request_list_send(*target), "MISSION_COUNT").count
        items: list[MissionItem] = []
        while len(items) < count:
            message = self._ask(
                lambda mav, *target: mav.mission_request_int_send(*target, len(items)), "MISSION_ITEM_INT"
            )
            if message.seq == len(items):
                items.append(item_from_int_message(message))
        self._connection.mav.mission_ack_send(*self._target, 0)
        return items

    @property
    def _target(self) -> tuple[int, int]:
        return self._connection.target_system, self._connection.target_component

    def _ask(self, send: Callable[..., None], *answers: str) -> Any:
        for _ in range(_TRIES):
            send(self._connection.mav, *self._target)
            end = time.monotonic() + _REPLY_TIMEOUT_S
            while (left_s := end - time.monotonic()) > 0:
                answer = self._connection.recv_match(type=[*answers, "STATUSTEXT"], blocking=True, timeout=left_s)
                if answer is not None and answer.get_type() in answers:
                    return answer
                if answer is not None:
                    self.texts.append(answer.text)
        raise ClientError(f"no {' or '.join(answers)} from the vehicle")


@contextmanager
def connect(host: str, port: int, timeout_s: float) -> Iterator[MissionClient]:
    """Connect to the vehicle on a UDP port; ClientError if no heartbeat arrives in time."""
    os.environ["MAVLINK20"] = "1"  # mavutil reads the version from the environment when it is imported
    from pymavlink import mavutil

    address = f"udpout:{host}:{port}"
    with closing(mavutil.mavlink_connection(address, source_system=255, source_component=190)) as connection:
        client = MissionClient(connection)
        if not client.connect(timeout_s):
            raise ClientError(f"no vehicle with a flight controller on UDP port {port} within {timeout_s:.0f} s")
        yield client
