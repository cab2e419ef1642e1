# SPDX-License-Identifier: GPL-3.0-or-later
"""An autopilot sends 3000 frames/s: all arrive, and a stalled client affects no other."""

import os
import socket
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter
from tests.support.benches import Starter
from tests.support.packing import pack
from tests.support.plain_station import PlainStation
from tests.support.programs import TIMEOUT_S, free_port

m = messages
DEAF = 251


class Autopilot:
    """An autopilot with ArduPilot's ids on a pty; its attitudes are numbered. Writes block until they are read."""

    def __init__(self, directory: Path) -> None:
        self._wire, self._terminal = os.openpty()
        tty.setraw(self._terminal)
        self.path = directory / "autopilot"
        self.path.symlink_to(os.ttyname(self._terminal))
        self._writer = FrameWriter(1, 1)
        self.sent = 0
        self._over = threading.Event()
        self._heartbeats = threading.Thread(target=self._send_heartbeat, daemon=True)
        self._heartbeats.start()

    def send(self, message: Message) -> None:
        os.write(self._wire, self._writer.frame(pack(message), 2))

    def send_attitudes(self, count: int, rate_hz: int) -> None:
        began_at = time.monotonic()
        for index in range(count):
            time.sleep(max(0.0, began_at + index / rate_hz - time.monotonic()))
            self.send(m.MAVLink_attitude_message(self.sent, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
            self.sent += 1

    def close(self) -> None:
        self._over.set()
        self._heartbeats.join()
        os.close(self._wire)
        os.close(self._terminal)

    def _send_heartbeat(self) -> None:
        writer = FrameWriter(1, 1)
        while not self._over.wait(0.5):
            os.write(self._wire, writer.frame(pack(m.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3)), 2))


@pytest.fixture
def autopilot(tmp_path: Path) -> Iterator[Autopilot]:
    autopilot = Autopilot(tmp_path)
    yield autopilot
    autopilot.close()


class Reader(threading.Thread):
    """Reads a connected socket up to the last attitude."""

    def __init__(self, connection: socket.socket, last: int) -> None:
        super().__init__(daemon=True)
        self._socket = connection
        self._last = last
        self.data = bytearray()
        self.frames: list[MavlinkFrame] = []

    @property
    def numbers(self) -> list[int]:
        attitudes = (frame for frame in self.frames if frame.msgid == m.MAVLINK_MSG_ID_ATTITUDE)
        return [int.from_bytes(frame.payload[:4].ljust(4, b"\0"), "little") for frame in attitudes]

    def assert_frames_are_whole(self) -> None:
        """Only frames were received; the last one may be incomplete."""
        whole = b"".join(frame.raw for frame in self.frames)
        assert self.data.startswith(whole)
        assert len(self.data) - len(whole) < 64

    def run(self) -> None:
        self._socket.settimeout(TIMEOUT_S)
        splitter = MavlinkSplitter()
        while True:
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                return
            self.data += data
            found = splitter.feed(data)
            self.frames += found
            if not data or any(frame.payload[:4] == self._last.to_bytes(4, "little") for frame in found):
                return


def connected_udp(port: int) -> socket.socket:
    connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    connection.connect(("127.0.0.1", port))
    return connection


def test_is_lossless_at_any_rate_and_a_stalled_client_gets_the_acks(start: Starter, autopilot: Autopilot) -> None:
    udp, tcp = free_port(), free_port(socket.SOCK_STREAM)
    daemon = start.daemon(str(autopilot.path), gcs=[f"udpin:127.0.0.1:{udp}", f"tcpin:127.0.0.1:{tcp}"])
    daemon.wait("MAVLink")
    stalled_socket = socket.create_connection(("127.0.0.1", tcp), TIMEOUT_S)
    reading_socket = socket.create_connection(("127.0.0.1", tcp), TIMEOUT_S)
    by_udp_socket = connected_udp(udp)
    with (
        PlainStation(stalled_socket, sysid=DEAF) as stalled,
        PlainStation(reading_socket) as reading,
        PlainStation(by_udp_socket, sysid=7) as by_udp,
    ):
        for station in (stalled, reading, by_udp):
            for _ in range(2):
                station.send_heartbeat()
                station.wait_for("HEARTBEAT")
        rates = ((9000, 3000), (40, 50), (9000, 3000), (40, 50))
        total = sum(count for count, _ in rates)
        readers = [Reader(connection, total - 1) for connection in (reading_socket, by_udp_socket)]
        for reader in readers:
            reader.start()
        for number, (count, rate_hz) in enumerate(rates):
            autopilot.send(m.MAVLink_command_ack_message(400 + number, 0, 0, 0, DEAF, 191))
            autopilot.send_attitudes(count, rate_hz)
        for reader in readers:
            reader.join(TIMEOUT_S)
            reader.assert_frames_are_whole()
        by_tcp, by_datagrams = readers
        assert by_tcp.numbers == list(range(total))
        # On a busy machine the reader's own socket may lose datagrams.
        assert by_datagrams.numbers == sorted(set(by_datagrams.numbers))
        assert len(by_datagrams.numbers) > total / 2
        late = Reader(stalled_socket, total)
        late.start()
        while late.is_alive():  # it reads what was sent before the stall, then new telemetry
            autopilot.send(m.MAVLink_attitude_message(total, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
            late.join(0.05)
    late.assert_frames_are_whole()
    acks = [frame for frame in late.frames if frame.msgid == m.MAVLINK_MSG_ID_COMMAND_ACK]
    assert [int.from_bytes(frame.payload[:2], "little") for frame in acks] == [400, 401, 402, 403]
    assert late.numbers == sorted(late.numbers)
    assert late.numbers[-1] == total
    assert len(late.numbers) < total / 2
    # Neither the port nor the autopilot was ever lost.
    assert not daemon.has_logged("fc.port_lost")
    assert len([entry for entry in daemon.events() if entry["event"] == "fc.found"]) == 1
