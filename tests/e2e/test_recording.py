# SPDX-License-Identifier: GPL-3.0-or-later
"""A running daemon's telemetry logs."""

import os
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as messages

from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import Daemon, run_naze_bridge, until
from tests.support.tlog import TlogRecord, read_tlog

STATION = 250
HEARTBEAT = 0
SYSTEM_STATE = messages.MAVLINK_MSG_ID_EXTENDED_SYS_STATE


def msgid_of(frame: bytes) -> int:
    return frame[5] if frame[0] == 0xFE else int.from_bytes(frame[7:10], "little")


class Listener:
    """A ground station that keeps all bytes received and sent."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(address)
        self._socket.setblocking(False)
        self._codec = messages.MAVLink(None, srcSystem=STATION, srcComponent=190)
        self.received: list[bytes] = []
        self.sent: list[bytes] = []

    def send(self, *what: Any) -> None:
        for message in what:
            frame = bytes(message.pack(self._codec))
            self._socket.send(frame)
            self.sent.append(frame)

    def listen(self) -> None:
        while True:
            try:
                data = self._socket.recv(4096)
            except BlockingIOError:
                return
            while data:
                size = data[1] + (8 if data[0] == 0xFE else 12)
                self.received.append(data[:size])
                data = data[size:]

    def has_received(self, msgid: int, count: int) -> bool:
        self.listen()
        return sum(msgid_of(frame) == msgid for frame in self.received) >= count

    def close(self) -> None:
        self._socket.close()


Connect = Callable[[Daemon], Listener]


@pytest.fixture
def connect() -> Iterator[Connect]:
    """A factory of ground stations known to a daemon."""
    with ExitStack() as stack:

        def connected(daemon: Daemon) -> Listener:
            listener = Listener(daemon.address)
            stack.callback(listener.close)
            for _ in range(2):  # the second shows that the address receives (bridge/gcs/return_path.py)
                listener.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            return listener

        yield connected


def logs_of(daemon: Daemon) -> list[Path]:
    return sorted((daemon.state_dir / "logs").glob("*.tlog"))


def records_of(path: Path) -> list[TlogRecord]:
    return list(read_tlog(path.read_bytes()))


@pytest.mark.parametrize("protocol", ["MSP", "MAVLink"])
def test_a_telemetry_log_holds_received_and_sent_frames(start: Starter, connect: Connect, protocol: str) -> None:
    board = start.board(*(("--armed", "--tele-prot", "2") if protocol == "MAVLink" else ()))
    daemon = start.daemon(str(board.link))
    daemon.wait(protocol)
    listener = connect(daemon)
    listener.send(messages.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    listener.send(messages.MAVLink_setup_signing_message(1, 1, bytes(range(32)), 1))
    listener.send(messages.MAVLink_mission_request_list_message(1, 1))
    until(lambda: listener.has_received(HEARTBEAT, 4), "telemetry")
    assert daemon.end() == 0
    listener.listen()

    (path,) = logs_of(daemon)
    records = records_of(path)
    recorded = [record.frame.raw for record in records if record.frame.sysid == 1]
    if protocol == "MSP":
        assert recorded == listener.received[1:]  # from the second heartbeat on, see connect()
    else:
        # A flight is logged at the default rates, independently of a ground station's own rates.
        assert {msgid_of(frame) for frame in listener.received} <= {msgid_of(frame) for frame in recorded}
    # A log begins with the vehicle's heartbeat, not the ground station's, and never contains the key.
    assert (records[0].frame.sysid, records[0].frame.msgid) == (1, HEARTBEAT)
    sent = [frame for frame in listener.sent if bytes(range(32)) not in frame]
    assert len(sent) == len(listener.sent) - 1
    from_station = [record.frame.raw for record in records if record.frame.sysid == STATION]
    # A flight's log may have begun before the first of the two heartbeats, which are alike.
    assert from_station == sent[1:] or (protocol == "MAVLink" and from_station == sent)

    reader = mavutil.mavlink_connection(str(path))
    for record in records:
        message = reader.recv_match()
        assert bytes(message.get_msgbuf()) == record.frame.raw
        assert message._timestamp == record.at_us * 1e-6
    assert reader.recv_match() is None
    reader.close()
    times = [record.at_us for record in records]
    assert times == sorted(times)
    assert os.path.getmtime(path) - 60 < times[0] / 1e6 <= times[-1] / 1e6 <= os.path.getmtime(path) + 1


def test_a_killed_daemon_loses_only_the_end_of_the_log(start: Starter, connect: Connect) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    listener = connect(daemon)
    until(lambda: logs_of(daemon), "a log")
    (path,) = logs_of(daemon)
    shown = run_naze_bridge("status", "--state-dir", daemon.state_dir).stdout
    assert f"telemetry log: {path}" in [line.split(maxsplit=1)[1] for line in shown.splitlines() if " " in line]

    def recorded() -> list[bytes]:
        return [record.frame.raw for record in records_of(path) if record.frame.sysid == 1]

    until(lambda: [msgid_of(frame) for frame in recorded()].count(SYSTEM_STATE) >= 4, "telemetry on the disk")
    daemon.end(signal.SIGKILL)
    listener.listen()
    kept = recorded()
    assert kept == listener.received[1 : len(kept) + 1]


def test_a_second_start_begins_a_second_log(start: Starter, connect: Connect) -> None:
    daemon = start.daemon("sim:")
    for count in (1, 2):
        daemon.wait()
        connect(daemon)
        until(lambda count=count: len(logs_of(daemon)) == count, "a log")  # type: ignore[misc]
        daemon.kill_and_restart()


def test_unwritable_logs_are_reported_once_without_delay(start: Starter, connect: Connect) -> None:
    (start.directory / "state").mkdir()
    (start.directory / "state" / "logs").write_text("in the way")
    daemon = start.daemon("sim:")
    daemon.wait()
    listener = connect(daemon)
    until(lambda: daemon.has_logged("tlog.stopped"), "a failed write")
    listener.listen()
    listener.received.clear()
    until(lambda: listener.has_received(HEARTBEAT, 2), "telemetry after it")
    shown = run_naze_bridge("status", "--state-dir", daemon.state_dir).stdout
    assert "telemetry log: stopped, File exists" in shown
    assert daemon.end() == 0
    assert [event["event"] for event in daemon.events() if "tlog" in event["event"]] == ["tlog.stopped"]


def test_recording_can_be_switched_off(start: Starter, connect: Connect) -> None:
    daemon = start.daemon("sim:", config="record_tlog = false\n")
    daemon.wait()
    listener = connect(daemon)
    until(lambda: listener.has_received(HEARTBEAT, 3), "telemetry")
    assert daemon.ask({"do": "status"})["recording"] == []
    assert daemon.end() == 0
    assert logs_of(daemon) == []


def test_other_users_cannot_read_the_files_of_a_daemon_run_by_hand(
    start: Starter, connect: Connect, tmp_path: Path
) -> None:
    before = os.umask(0o022)
    try:
        daemon = start.daemon("sim:", state_dir=tmp_path / "private")
        daemon.wait()
        daemon.push(plain_plan(3))
    finally:
        os.umask(before)
    connect(daemon)
    until(lambda: logs_of(daemon), "a log")
    stored = [daemon.state_dir, *daemon.state_dir.rglob("*")]
    assert {path.name for path in stored} >= {"private", "missions.db", "logs"}
    # The control socket has its own check: the service's group may use it.
    assert [path for path in stored if is_open_to_others(path) and not path.is_socket()] == []


def is_open_to_others(path: Path) -> bool:
    with suppress(FileNotFoundError):  # a draft, which has its real name meanwhile
        return bool(path.stat().st_mode & 0o077)
    return False
