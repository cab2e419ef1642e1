# SPDX-License-Identifier: GPL-3.0-or-later
"""A small MAVLink ground station that writes and reads missions over UDP, for the demonstration."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from protocols.mavlink.codec import item_from_int_message, item_message
from protocols.mavlink.dialect import Message, messages
from protocols.mission_item import MissionItem, MissionResult

_REPLY_TIMEOUT_S = 1.0
_TRIES = 8


class ClientError(Exception):
    """The vehicle did not carry out a request; one sentence."""


class MissionClient:
    """A connection to one vehicle. `texts` collects received STATUSTEXTs."""

    def __init__(self, link: Message, sysid: int, compid: int) -> None:
        self._link = link
        self._sysid = sysid
        self._compid = compid
        self.texts: list[str] = []

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
        self._link.mav.send(messages.MAVLink_mission_ack_message(self._sysid, self._compid, 0, 0))
        return items

    def _ask(self, message: Message, *answers: str) -> Message:
        for _ in range(_TRIES):
            self._link.mav.send(message)
            while True:
                answer = self._link.recv_match(type=[*answers, "STATUSTEXT"], blocking=True, timeout=_REPLY_TIMEOUT_S)
                if answer is None:
                    break
                if answer.get_type() != "STATUSTEXT":
                    return answer
                self.texts.append(answer.text)
        raise ClientError(f"no answer to {message.get_type()}")


@contextmanager
def connect(host: str, port: int, timeout_s: float) -> Iterator[MissionClient]:
    """Connect to the vehicle on a UDP port; ClientError if no heartbeat arrives in time."""
    from pymavlink import mavutil  # with numpy and every dialect: --help does without

    link = mavutil.mavlink_connection(f"udpout:{host}:{port}", source_system=255, source_component=190)
    try:
        for _ in range(max(int(timeout_s / 0.2), 1)):
            link.mav.heartbeat_send(messages.MAV_TYPE_GCS, messages.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            heartbeat = link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.2)
            linked = heartbeat is not None and heartbeat.system_status != messages.MAV_STATE_UNINIT
            if linked:
                yield MissionClient(link, heartbeat.get_srcSystem(), heartbeat.get_srcComponent())
                return
        raise ClientError(f"no vehicle with a flight controller on UDP port {port} within {timeout_s:.0f} s")
    finally:
        link.close()
