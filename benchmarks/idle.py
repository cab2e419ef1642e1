# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of an idle daemon: CPU, memory, and the time from its start to its first heartbeat.

It polls a simulated Naze on a pseudo-terminal at 115200 baud and sends telemetry to one UDP address: first no
station answers from there, then one that requests nothing, then one that requests Mission Planner's rates. The Naze
runs in another process and is not counted.
"""

import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from benchmarks.figure import Figure, Floor
from benchmarks.processes import ENVIRONMENT, Board, cpu_s, daemon, floor_program, simulated_naze
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkSplitter

_SETTLING_S = 3.0
_WATCHED_S = 20.0
_STARTS = 7
_DIALECT = "import protocols.mavlink.dialect"
#: Hz by stream.
_MISSION_PLANNER_HZ = {
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: 2,
    mavlink.MAV_DATA_STREAM_POSITION: 2,
    mavlink.MAV_DATA_STREAM_EXTRA1: 4,
    mavlink.MAV_DATA_STREAM_EXTRA2: 4,
    mavlink.MAV_DATA_STREAM_EXTRA3: 2,
    mavlink.MAV_DATA_STREAM_RAW_SENSORS: 2,
    mavlink.MAV_DATA_STREAM_RC_CHANNELS: 2,
}
_MISSION_PLANNER = [
    messages.MAVLink_request_data_stream_message(1, 1, stream, rate_hz, 1)
    for stream, rate_hz in _MISSION_PLANNER_HZ.items()
]
LIBRARIES = f"import asyncio, sqlite3, serial, structlog, fastcrc; {_DIALECT}"


def measure() -> list[Figure]:
    """Measure one idle daemon, and several starts."""
    with tempfile.TemporaryDirectory() as name, simulated_naze(Path(name)) as board:
        _first_heartbeat_s(Path(name), board)  # compiles missing bytecode, which costs time and memory
        return [*_idle(Path(name), board), *_starts(Path(name), board)]


def _idle(folder: Path, board: Board) -> list[Figure]:
    bare_folder = folder / "bare"
    bare_folder.mkdir()
    with (
        simulated_naze(bare_folder) as bare_board,
        floor_program(bare_folder, "poll", str(bare_board.link)) as (bare_pid, _),
        listener() as ground,
        daemon(folder, board.link, udpout(ground)) as process,
    ):
        process.wait_for_event("fc.found")
        (unanswered_percent,) = cpu_percents(process.pid)
        with _connected(ground):
            # At the same time, so that both see the same load of the machine.
            percent, bare_percent = cpu_percents(process.pid, bare_pid)
        with _connected(ground, _MISSION_PLANNER):
            (mission_planner_percent,) = cpu_percents(process.pid)
        memory_mb = resident_mb(process.pid)
    floor = Floor(bare_percent, "bare polls")
    return [
        Figure("idle daemon, CPU of one core, no station has answered", unanswered_percent, "%", None, 2.0),
        Figure("idle daemon, CPU of one core, default rates", percent, "%", floor, 3.0, times_floor=True),
        Figure("idle daemon, CPU of one core, Mission Planner's rates", mission_planner_percent, "%", None, 2.0),
        Figure("idle daemon, resident", memory_mb, "MB", Floor(libraries_mb(LIBRARIES), "its libraries"), 42.0),
    ]


@contextmanager
def _connected(ground: socket.socket, requests: Sequence[Message] = ()) -> Iterator[None]:
    """Answer as a ground station: send requests, then a heartbeat every second."""
    writer = FrameWriter(255, 190)
    heartbeat = messages.MAVLink_heartbeat_message(messages.MAV_TYPE_GCS, messages.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
    _, vehicle = ground.recvfrom(2048)
    ended = threading.Event()

    def beat() -> None:
        while not ended.wait(1.0):
            ground.sendto(writer.frame(pack(heartbeat), 2), vehicle)

    for message in (heartbeat, *requests):
        ground.sendto(writer.frame(pack(message), 2), vehicle)
    thread = threading.Thread(target=beat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _starts(folder: Path, board: Board) -> list[Figure]:
    seconds = [_first_heartbeat_s(folder, board) for _ in range(_STARTS)]
    python, dialect = _start_s("pass"), _start_s(_DIALECT)
    return [
        Figure("python -c pass", python, "s"),
        Figure(
            f"start to first heartbeat, median of {_STARTS}",
            statistics.median(seconds),
            "s",
            Floor(dialect, "python, MAVLink dialect"),
            0.5,
        ),
        Figure(f"start to first heartbeat, worst of {_STARTS}", max(seconds), "s", Floor(dialect, "the same")),
    ]


def _first_heartbeat_s(folder: Path, board: Board) -> float:
    with listener() as ground, daemon(folder, board.link, udpout(ground)) as process:
        while True:
            frames = MavlinkSplitter().feed(ground.recv(2048))
            if any(frame.msgid == messages.MAVLINK_MSG_ID_HEARTBEAT for frame in frames):
                return time.time() - process.started_at


def _start_s(program: str) -> float:
    """The median time of a Python program from start to exit, seconds."""
    times = []
    for _ in range(_STARTS):
        began_at = time.perf_counter()
        subprocess.run([sys.executable, "-c", program], env=ENVIRONMENT, check=True)
        times.append(time.perf_counter() - began_at)
    return statistics.median(times)


def libraries_mb(libraries: str) -> float:
    """The resident size of a Python process after some imports, without the daemon, megabytes."""
    show = "print(open('/proc/self/status').read())"
    command = [sys.executable, "-c", f"{libraries}; {show}"]
    result = subprocess.run(command, env=ENVIRONMENT, check=True, capture_output=True, text=True)
    return _rss_mb(result.stdout)


def listener() -> socket.socket:
    """A socket on which a ground station listens."""
    ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ground.bind(("127.0.0.1", 0))
    ground.settimeout(10)
    return ground


def udpout(ground: socket.socket) -> str:
    """The daemon's connection to it."""
    return f"udpout:127.0.0.1:{ground.getsockname()[1]}"


def cpu_percents(*pids: int) -> list[float]:
    """Watch processes for a while; returns their CPU times in percent of one core."""
    time.sleep(_SETTLING_S)
    before, began_at = [cpu_s(pid) for pid in pids], time.perf_counter()
    time.sleep(_WATCHED_S)
    watched_s = time.perf_counter() - began_at
    return [(cpu_s(pid) - spent) / watched_s * 100 for pid, spent in zip(pids, before, strict=True)]


def resident_mb(pid: int) -> float:
    """The current memory of a process, megabytes."""
    return _rss_mb(Path(f"/proc/{pid}/status").read_text())


def _rss_mb(status: str) -> float:
    return int(status.partition("VmRSS:")[2].split()[0]) * 1024 / 1e6
