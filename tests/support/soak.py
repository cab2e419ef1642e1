# SPDX-License-Identifier: GPL-3.0-or-later
"""The events of a soak test and its monitors. All random choices come from a seed."""

import os
import random
import select
import socket
import struct
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as messages

from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import MissionResult
from protocols.msp.mission import unpack_records
from tests.support.packing import pack
from tests.support.plain_station import tcp_station, udp_station
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import Board, Daemon

m = messages
VEHICLE = 1
#: Linux; Python has no name for it.
_SO_TIMESTAMPNS = 35
_MAX_STALLED = 5
#: Half a step of a single-precision float at 45 degrees is 19e-7.
_ROUNDING_E7 = 40


class Stalls(threading.Thread):
    """Measures how long the machine ran no process at all; gaps then are not the daemon's fault."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._over = threading.Event()
        self._stalls: list[tuple[float, float]] = []

    def run(self) -> None:
        while not self._over.is_set():
            before = time.time()
            self._over.wait(0.02)
            after = time.time()
            if after - before > 0.1:
                self._stalls.append((before, after))

    def seconds(self, since: float, until: float) -> float:
        return sum(max(0.0, min(after, until) - max(before, since)) for before, after in self._stalls if after > since)

    def end(self) -> None:
        self._over.set()
        self.join()


class HeartbeatMonitor(threading.Thread):
    """A ground station that requests all telemetry and checks it."""

    def __init__(self, address: tuple[str, int], stalls: Stalls, pid: int) -> None:
        super().__init__(daemon=True)
        self._threads = Path(f"/proc/{pid}/task")
        self._queued_s = 0.0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        # The time of arrival, not of this thread's wake-up.
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._socket.connect(address)
        self._stalls = stalls
        self._over = threading.Event()
        self._writer = FrameWriter(255, 190)
        self._beat_at: float | None = None
        self.damaged: list[bytes] = []
        self.frames: Counter[int] = Counter()
        #: Gaps between two heartbeats of the vehicle, less the time in which the machine stalled or the daemon waited
        #: for a processor.
        self.gaps_s: list[float] = []

    def run(self) -> None:
        beat_due = time.monotonic()
        while not self._over.is_set():
            if time.monotonic() >= beat_due:
                beat_due += 1.0
                self._send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
                # Repeated because the daemon forgets the requests of a displaced peer.
                self._send(m.MAVLink_command_long_message(VEHICLE, 1, 511, 0, 30, 10000, 0, 0, 0, 0, 0))
            if select.select([self._socket], [], [], 0.1)[0]:
                data, extra, _, _ = self._socket.recvmsg(2048, 64)
                seconds, nanoseconds = struct.unpack("qq", extra[0][2])
                self._check(data, seconds + nanoseconds / 1e9)

    def end(self) -> None:
        self._over.set()
        self.join()
        self._socket.close()

    def _send(self, message: Message) -> None:
        self._socket.send(self._writer.frame(pack(message), 2))

    def _check(self, data: bytes, at: float) -> None:
        frames = MavlinkSplitter().feed(data)
        if b"".join(frame.raw for frame in frames) != data:
            self.damaged.append(data)
        for frame in frames:
            self.frames[frame.msgid] += 1
            if frame.msgid == m.MAVLINK_MSG_ID_HEARTBEAT and frame.sysid == VEHICLE:
                queued_s = self._queued()
                if self._beat_at is not None:
                    lost_s = max(queued_s - self._queued_s, self._stalls.seconds(self._beat_at, at))
                    self.gaps_s.append(at - self._beat_at - lost_s)
                self._beat_at, self._queued_s = at, queued_s

    def _queued(self) -> float:
        """The time that the daemon's threads have waited for a processor, s (/proc/PID/schedstat).

        Summed over all threads, because a waiting one may hold the interpreter's lock.
        """
        waited_s = 0.0
        for thread in self._threads.glob("*/schedstat"):
            with suppress(OSError, IndexError):  # the thread has ended
                waited_s += int(thread.read_text().split()[1]) / 1e9
        return waited_s or self._queued_s


class BoardEvents(threading.Thread):
    """Events at the flight controller, one of each kind in random order, then again; each ends after a while."""

    def __init__(self, board: Board, chance: random.Random) -> None:
        super().__init__(daemon=True)
        self._board = board
        self._chance = chance
        self._over = threading.Event()
        self.happened: Counter[str] = Counter()
        self._kinds: list[Callable[[], None]] = [self._unplug, self._move, self._cut_power, self._reset]
        self._kinds += [self._arm, self._arm_shortly, self._hang]

    def run(self) -> None:
        deck: list[Callable[[], None]] = []
        while not self._over.is_set():
            deck = deck or self._chance.sample(self._kinds, len(self._kinds))
            kind = deck.pop()
            kind()
            self.happened[kind.__name__.strip("_")] += 1
            self._pass(0.5, 8.0)

    def end(self) -> None:
        self._over.set()
        self.join()

    def _pass(self, least: float, most: float) -> None:
        self._over.wait(self._chance.uniform(least, most))

    def _unplug(self) -> None:
        self._board.set("unplug")
        self._pass(0.05, 3.0)
        self._board.set("plug")

    def _move(self) -> None:
        """Unplug it; plugged in again, the port behind the same link has another name because the old one is in use."""
        self._board.set("unplug")
        taken = os.openpty()
        self._board.set("plug")
        for end in taken:
            os.close(end)

    def _cut_power(self) -> None:
        self._board.set("power off")
        self._pass(0.0, 3.0)
        self._board.set("power on")

    def _reset(self) -> None:
        self._board.set("power off")
        self._board.set("power on")

    def _hang(self) -> None:
        self._board.set("hang 1")
        self._pass(0.1, 2.8)
        self._board.set("hang 0")

    def _arm(self) -> None:
        self._board.set("armed 1")
        self._pass(3.0, 6.0)
        self._board.set("armed 0")

    def _arm_shortly(self) -> None:
        self._board.set("armed 1")
        self._pass(0.0, 0.5)
        self._board.set("armed 0")


class Crowd:
    """Ground stations that come and go, stall, move, send garbage and write missions; and attackers.

    A write to the flight controller at most every `write_interval_s`: one address has 200 before the wear limit.
    """

    def __init__(
        self, daemon: Daemon, udp_port: int, tcp_port: int, chance: random.Random, write_interval_s: float
    ) -> None:
        self._daemon = daemon
        self._address = ("127.0.0.1", udp_port)
        self._tcp_port = tcp_port
        self._chance = chance
        self._stalled: list[socket.socket] = []
        self._abandoned: list[socket.socket] = []
        self.happened: Counter[str] = Counter()
        self.uploads: Counter[str] = Counter()
        self._write_interval_s, self._may_write_at = write_interval_s, 0.0
        self._kinds: list[Callable[[Board], None]] = [self._upload, self._upload, self._upload, self._download]
        self._kinds += [
            self._visit,
            self._move,
            self._send_garbage,
            self._connect_by_tcp,
            self._stall,
            self._stall,
            self._request_without_reading,
        ]
        self._kinds += [self._flood, self._change_addresses, self._abandon_upload]

    def act(self, board: Board) -> None:
        kind = self._chance.choice(self._kinds)
        kind(board)
        self.happened[kind.__name__.strip("_")] += 1

    def leave(self) -> None:
        for client in (*self._stalled, *self._abandoned):
            client.close()
        self._stalled.clear()
        self._abandoned.clear()

    def try_upload(self, board: Board) -> bool:
        """Write a mission; True if accepted, after checking that the board holds it."""
        plan = plain_plan(self._chance.randrange(2, 80), start=self._chance.randrange(100))
        by_tcp = self._chance.random() < 0.5
        with tcp_station(self._tcp_port) if by_tcp else udp_station(self._address) as station:
            station.send_heartbeat()
            result = station.upload(plan)
        if result is MissionResult.ACCEPTED:
            assert _near(board.records(), records_of(judge(plan))), f"{len(plan)} accepted items are not there"
        else:
            # Refused at once without a flight controller; not ten times a second.
            self._rest()
        self.uploads[result.name] += 1
        return result is MissionResult.ACCEPTED

    def _upload(self, board: Board) -> None:
        if (now := time.monotonic()) < self._may_write_at:
            self._abandon_upload(board)
            return
        self._may_write_at = now + self._write_interval_s
        self.try_upload(board)

    def _download(self, board: Board) -> None:
        """Request the list and some of its items, without a final ack."""
        with self._udp() as client:
            self._send(client, m.MAVLink_mission_request_list_message(1, 1))
            for seq in range(5):
                self._send(client, m.MAVLink_mission_request_int_message(1, 1, seq))

    def _visit(self, board: Board) -> None:
        with self._udp() as client:
            self._send(client, m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), sysid=self._chance.randrange(2, 255))
            self._send(client, m.MAVLink_param_request_list_message(1, 1))
            self._rest()

    def _move(self, board: Board) -> None:
        """One ground station moving between addresses; sometimes it abandons an upload."""
        for _ in range(5):
            with self._udp() as client:
                self._send(client, m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), sysid=77)
                if self._chance.random() < 0.02:
                    self._send(client, m.MAVLink_mission_count_message(1, 1, 9), sysid=77)
                self._rest()

    def _send_garbage(self, board: Board) -> None:
        frame = FrameWriter(9, 9).frame(pack(m.MAVLink_mission_count_message(1, 1, 9)), 2)
        with self._udp() as client:
            for _ in range(20):
                noise = self._chance.randbytes(self._chance.randrange(1, 300))
                client.send(
                    self._chance.choice((noise, frame[: self._chance.randrange(len(frame))], noise + frame[:9]))
                )

    def _connect_by_tcp(self, board: Board) -> None:
        """Connect by TCP, read whole frames for a while, and disconnect in one of several ways."""
        with self._tcp() as client:
            self._send(client, m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            self._rest()
            self._read_whole_frames(client)
            if self._chance.random() < 0.5:
                # A reset instead of an end.
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def _stall(self, board: Board) -> None:
        """Connect by TCP without reading; earlier such clients resume reading or disconnect."""
        client = self._tcp()
        self._send(client, m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self._stalled.append(client)
        if len(self._stalled) > _MAX_STALLED:
            earlier = self._stalled.pop(self._chance.randrange(_MAX_STALLED))
            if self._chance.random() < 0.5:
                self._read_whole_frames(earlier)
            earlier.close()

    def _request_without_reading(self, board: Board) -> None:
        """Request everything over TCP without reading a reply."""
        with self._tcp() as client:
            client.settimeout(0.2)
            for _ in range(300):
                try:
                    self._send(client, m.MAVLink_param_request_list_message(1, 1))
                except OSError:
                    # The daemon has stopped reading or disconnected.
                    return

    def _flood(self, board: Board) -> None:
        """Request everything as fast as possible."""
        requests = [
            m.MAVLink_param_request_list_message(1, 1),
            m.MAVLink_mission_count_message(1, 1, 9),
            m.MAVLink_mission_request_list_message(1, 1),
            m.MAVLink_command_long_message(1, 1, 42428, 0, 0, 0, 0, 0, 0, 0, 0),
            m.MAVLink_command_long_message(1, 1, 511, 0, 30, 1, 0, 0, 0, 0, 0),
        ]
        frames = [FrameWriter(66, 190).frame(pack(message), 2) for message in requests]
        with self._udp() as client:
            for number in range(2000):
                client.send(frames[number % len(frames)])

    def _change_addresses(self, board: Board) -> None:
        """Send once from each of hundreds of addresses."""
        for _ in range(300):
            with self._udp() as client:
                self._send(client, m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), sysid=65)

    def _abandon_upload(self, board: Board) -> None:
        """Announce a list and send only its first item."""
        client = self._udp()
        self._send(client, m.MAVLink_mission_count_message(1, 1, 100), sysid=64)
        self._rest()
        self._send(client, m.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 1, 1, 9.0), sysid=64)
        self._abandoned.append(client)
        if len(self._abandoned) > _MAX_STALLED:
            self._abandoned.pop(0).close()

    def _rest(self) -> None:
        time.sleep(self._chance.uniform(0.0, 0.5))

    def _udp(self) -> socket.socket:
        client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        client.connect(self._address)
        return client

    def _tcp(self) -> socket.socket:
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        client.connect(("127.0.0.1", self._tcp_port))
        return client

    def _send(self, client: socket.socket, message: Message, sysid: int = 251) -> None:
        client.send(FrameWriter(sysid, 190).frame(pack(message), 2))

    def _read_whole_frames(self, client: socket.socket) -> None:
        client.settimeout(0.1)
        splitter, data, whole = MavlinkSplitter(), b"", b""
        for _ in range(100):
            try:
                piece = client.recv(65536)
            except OSError:
                break
            data += piece
            whole += b"".join(frame.raw for frame in splitter.feed(piece))
            if not piece:
                break
        assert data.startswith(whole), "a client that reads again gets a damaged frame"
        assert len(data) - len(whole) < 280


def _near(found: list[str], sent: list[str]) -> bool:
    """True if the records are equal; positions written as single-precision floats may differ by 0.4 m."""
    pairs = list(zip(*(unpack_records(bytes.fromhex("".join(records))) for records in (found, sent)), strict=False))
    return len(found) == len(sent) and all(
        there._replace(lat_e7=wanted.lat_e7, lon_e7=wanted.lon_e7) == wanted
        and max(abs(there.lat_e7 - wanted.lat_e7), abs(there.lon_e7 - wanted.lon_e7)) <= _ROUNDING_E7
        for there, wanted in pairs
    )


class Meter:
    """Memory and file descriptors of a process."""

    def __init__(self, pid: int) -> None:
        self._folder = Path("/proc") / str(pid)

    def memory_kb(self) -> int:
        lines = (self._folder / "status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:"))

    def descriptors(self) -> list[str]:
        found = []
        for entry in (self._folder / "fd").iterdir():
            with suppress(FileNotFoundError):  # closed meanwhile
                found.append(os.readlink(entry))
        return sorted(found)
