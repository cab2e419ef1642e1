# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station that follows MAVLink's mission protocol, on any socket, with any pymavlink dialect."""

import select
import socket
import time
from collections.abc import Iterator, Sequence
from types import ModuleType, TracebackType
from typing import Any, Self

from pymavlink.dialects.v20 import ardupilotmega as v20

from protocols.mission_item import MissionResult
from tests.support.plan import PlanRow
from tests.support.programs import TIMEOUT_S

SYSID, COMPID = 250, 191
_RETRY_S = 0.5
_STALE_S = 0.02


class PlainStation:
    """A station on a connected socket, which it then owns. `dialect` None: MAVLink 2.

    `received` has every received message, also those not waited for.
    """

    def __init__(
        self,
        connection: socket.socket,
        dialect: ModuleType | None = None,
        sysid: int = SYSID,
        compid: int = COMPID,
    ) -> None:
        self._socket = connection
        self._dialect: Any = dialect or v20
        self._codec = self._dialect.MAVLink(None, srcSystem=sysid, srcComponent=compid)
        self._codec.robust_parsing = True
        self.received: list[Any] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    @property
    def own_address(self) -> tuple[str, int]:
        host, port = self._socket.getsockname()[:2]
        return host, port

    def send(self, message: Any) -> None:
        self._socket.sendall(bytes(message.pack(self._codec)))
        self._codec.seq = (self._codec.seq + 1) & 0xFF

    def send_heartbeat(self) -> None:
        self.send(self._dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))

    def has_data(self) -> bool:
        return bool(select.select([self._socket], [], [], 0)[0])

    def wait_for(self, *kinds: str) -> Any:
        """The next message of one of these types."""
        for message in self._messages(TIMEOUT_S):
            if message.get_type() in kinds:
                return message
        raise AssertionError(f"no {kinds} received")

    def upload(self, plan: Sequence[PlanRow]) -> MissionResult:
        """Upload a list, item by item as requested; return the final ack."""
        # A station that reads all the time has had the repeated acks of its last upload by now.
        for _ in self._messages(_STALE_S):
            pass
        is_asked = False
        for _ in range(20 * len(plan)):
            if not is_asked:
                self.send_count(len(plan))
            for message in self._messages(_RETRY_S):
                if message.get_type() == "MISSION_ACK":
                    return MissionResult(message.type)
                if message.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
                    is_asked = True
                    self.send_item(plan, message.seq)
        raise AssertionError("no final MISSION_ACK received")

    def send_count(self, count: int) -> None:
        self.send(self._dialect.MAVLink_mission_count_message(1, 1, count))

    def send_item(self, plan: Sequence[PlanRow], seq: int) -> None:
        row = plan[seq]
        parameters = (row.p1, row.p2, row.p3, row.p4, int(row.lat * 1e7), int(row.lng * 1e7), row.alt)
        self.send(self._dialect.MAVLink_mission_item_int_message(1, 1, seq, row.frame, row.command, 0, 1, *parameters))

    def clear(self) -> MissionResult:
        self.send(self._dialect.MAVLink_mission_clear_all_message(1, 1))
        return MissionResult(self.wait_for("MISSION_ACK").type)

    def download(self) -> list[tuple[float, ...]]:
        """Download seq, command, frame, param1..4, lat_e7, lon_e7 and height of each item."""
        self.send(self._dialect.MAVLink_mission_request_list_message(1, 1))
        count = self.wait_for("MISSION_COUNT").count
        items: list[tuple[float, ...]] = []
        for seq in range(count):
            self.send(self._dialect.MAVLink_mission_request_int_message(1, 1, seq))
            m = self.wait_for("MISSION_ITEM_INT")
            items.append((m.seq, m.command, m.frame, m.param1, m.param2, m.param3, m.param4, m.x, m.y, m.z))
        return items

    def _messages(self, seconds: float) -> Iterator[Any]:
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self._socket.settimeout(left)
            try:
                data = self._socket.recv(4096)
            except TimeoutError:
                return
            assert data, "the daemon disconnected"
            for message in self._codec.parse_buffer(data) or []:
                if message.get_type() != "BAD_DATA":
                    self.received.append(message)
                    yield message


def udp_station(
    address: tuple[str, int],
    dialect: ModuleType | None = None,
    sysid: int = SYSID,
    compid: int = COMPID,
    host: str = "127.0.0.1",
) -> PlainStation:
    connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    connection.bind((host, 0))
    connection.connect(address)
    return PlainStation(connection, dialect, sysid, compid)


def tcp_station(port: int) -> PlainStation:
    return PlainStation(socket.create_connection(("127.0.0.1", port), TIMEOUT_S))
