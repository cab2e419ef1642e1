# SPDX-License-Identifier: GPL-3.0-or-later
"""A small MAVLink ground station that writes and reads missions over UDP, for the demonstration."""

import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from protocols.mavlink.codec import FrameWriter, decode, item_from_int_message, item_message, pack
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from protocols.mission_item import MissionItem, MissionResult

_HEARTBEAT_INTERVAL_S = 0.2
_REPLY_TIMEOUT_S = 1.0
_TRIES = 8
_DATAGRAM_SIZE = 2048


class ClientError(Exception):
    """The vehicle did not carry out a request; one sentence."""


class MissionClient:
    """A connection to one vehicle. `texts` collects received STATUSTEXTs."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._address = address
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._writer, self._splitter = FrameWriter(255, 190), MavlinkSplitter()
        self._sysid, self._compid = 0, 0
        self.texts: list[str] = []

    def connect(self, timeout_s: float) -> bool:
        """Wait for the heartbeat of a vehicle with a flight controller; False if none arrives in time."""
        heartbeat = messages.MAVLink_heartbeat_message(
            messages.MAV_TYPE_GCS, messages.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3
        )
        for _ in range(max(round(timeout_s / _HEARTBEAT_INTERVAL_S), 1)):
            self._send(heartbeat)
            for frame, message in self._received(_HEARTBEAT_INTERVAL_S):
                if message.get_type() == "HEARTBEAT" and message.system_status != messages.MAV_STATE_UNINIT:
                    self._sysid, self._compid = frame.sysid, frame.compid
                    return True
        return False

    def close(self) -> None:
        self._socket.close()

    def write(self, items: Sequence[MissionItem], progress: Callable[[int], None]) -> MissionResult:
        """Upload a list; returns the type of the final MISSION_ACK."""
        count = messages.MAVLink_mission_count_message(self._sysid, self._compid, len(items), 0)
        answer = self._ask(count, "MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
        while answer.get_type() != "MISSION_ACK":
            progress(answer.seq)
            item = item_message(items[answer.seq], self._sysid, self._compid, as_int=True)
            answer = self._ask(item, "MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
        progress(len(items))
        return MissionResult(answer.type)

    def read(self) -> list[MissionItem]:
        request_list = messages.MAVLink_mission_request_list_message(self._sysid, self._compid, 0)
        count = self._ask(request_list, "MISSION_COUNT").count
        items: list[MissionItem] = []
        while len(items) < count:
            wanted = messages.MAVLink_mission_request_int_message(self._sysid, self._compid, len(items), 0)
            message = self._ask(wanted, "MISSION_ITEM_INT")
            if message.seq == len(items):
                items.append(item_from_int_message(message))
        self._send(messages.MAVLink_mission_ack_message(self._sysid, self._compid, 0, 0))
        return items

    def _ask(self, message: Message, *answers: str) -> Message:
        for _ in range(_TRIES):
            self._send(message)
            for _, answer in self._received(_REPLY_TIMEOUT_S):
                if answer.get_type() in answers:
                    return answer
                if answer.get_type() == "STATUSTEXT":
                    self.texts.append(answer.text)
        raise ClientError(f"no answer to {message.get_type()}")

    def _send(self, message: Message) -> None:
        self._socket.sendto(self._writer.frame(pack(message), 2), self._address)

    def _received(self, timeout_s: float) -> Iterator[tuple[MavlinkFrame, Message]]:
        """The messages that arrive within a time."""
        end = time.monotonic() + timeout_s
        while (left_s := end - time.monotonic()) > 0:
            self._socket.settimeout(left_s)
            try:
                frames = self._splitter.feed(self._socket.recv(_DATAGRAM_SIZE))
            except TimeoutError:
                return
            for frame in frames:
                if (message := decode(frame.msgid, frame.payload)) is not None:
                    yield frame, message


@contextmanager
def connect(host: str, port: int, timeout_s: float) -> Iterator[MissionClient]:
    """Connect to the vehicle on a UDP port; ClientError if no heartbeat arrives in time."""
    client = MissionClient((host, port))
    try:
        if not client.connect(timeout_s):
            raise ClientError(f"no vehicle with a flight controller on UDP port {port} within {timeout_s:.0f} s")
        yield client
    finally:
        client.close()
