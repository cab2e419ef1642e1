# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot under attack, whose heartbeats are counted, and attackers that send without reading."""

import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.dialect import Message
from protocols.mavlink.signing import key_from_passphrase, ticks
from protocols.mission_item import MissionResult
from tests.support.plain_station import PlainStation
from tests.support.plan import PlanRow, judge, records_of
from tests.support.programs import Board, Daemon
from tests.support.soak import HeartbeatMonitor, Stalls

m = messages
#: The heartbeat of a ground station.
HELLO = m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
#: A vehicle's heartbeat comes every second.
LONGEST_GAP_S = 1.1


class Stranger:
    """An attacker's socket, which reads only on request."""

    def __init__(self, address: tuple[str, int], host: str = "127.0.0.1", sysid: int = 99, compid: int = 190) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((host, 0))
        self._socket.connect(address)
        self._codec: Any = m.MAVLink(None, srcSystem=sysid, srcComponent=compid)

    def send(self, *messages: Message) -> None:
        for message in messages:
            self.send_bytes(bytes(message.pack(self._codec)))

    def send_bytes(self, data: bytes) -> None:
        with suppress(ConnectionRefusedError):
            self._socket.send(data)

    def received(self) -> list[Any]:
        found: list[Any] = []
        self._socket.setblocking(False)
        while True:
            try:
                found += self._codec.parse_buffer(self._socket.recv(2048)) or []
            except BlockingIOError:
                return found

    def close(self) -> None:
        self._socket.close()


class Attack(threading.Thread):
    """A context in which an action is repeated `per_s` times a second."""

    def __init__(self, action: Callable[[], None], per_s: float) -> None:
        super().__init__(daemon=True)
        self._action = action
        self._pause_s = 1 / per_s
        self._over = threading.Event()
        self.count = 0

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self.join()

    def run(self) -> None:
        due = time.monotonic()
        while not self._over.is_set():
            self._action()
            self.count += 1
            due = max(due + self._pause_s, time.monotonic() - 0.1)
            self._over.wait(max(0.0, due - time.monotonic()))


def has_read_all(port: int) -> bool:
    """True if a program has read all datagrams that arrived at a UDP port; the kernel's buffer for them is small."""
    sockets = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    unread = [queues.partition(":")[2] for _, at, _, _, queues, *_ in sockets if at.endswith(f":{port:04X}")]
    return not any(int(size, 16) for size in unread)


class Watch:
    """A context that watches the pilot's heartbeats and fails at its end if any is missing."""

    def __init__(self, daemon: Daemon) -> None:
        self._stalls = Stalls()
        self._monitor = HeartbeatMonitor(daemon.address, self._stalls, daemon.process.pid)

    def __enter__(self) -> HeartbeatMonitor:
        self._stalls.start()
        self._monitor.start()
        return self._monitor

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._monitor.end()
        self._stalls.end()
        if kind is None:
            assert len(self._monitor.gaps_s) >= 2
            assert max(self._monitor.gaps_s) <= LONGEST_GAP_S, self._monitor.gaps_s
            assert self._monitor.damaged == []


def assert_uploads(pilot: PlainStation, board: Board, plan: Sequence[PlanRow]) -> None:
    """The pilot's list is accepted and stored on the board.

    On a busy machine an upload can come to a standstill for seconds and be cancelled: the pilot writes again.
    """
    for _ in range(3):
        result = pilot.upload(plan)
        if result is not MissionResult.OPERATION_CANCELLED:
            break
    texts = [message.text for message in pilot.received if message.get_type() == "STATUSTEXT"]
    assert result is MissionResult.ACCEPTED, (result.name, texts)
    assert board.records() == records_of(judge(plan))


def sign(codec: Any, passphrase: str) -> None:
    """Let a pymavlink codec sign from now on."""
    codec.signing.secret_key, codec.signing.sign_outgoing = key_from_passphrase(passphrase), True
    codec.signing.timestamp = ticks(time.time())
