# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of telemetry over MSP: CPU, the time from a reply to its datagram, and noise.

CPU: the daemon polls a simulated Naze that keeps the pace of a UART, and sends the 100 datagrams per second that one
ground station requested, or only attitudes. Latency: the other end of the terminal is in this process; each attitude
is numbered, so that a datagram is matched with its reply. The floor of both is a bare loop that polls its own board at
the same rates at the same time (benchmarks.floors). Noise needs no port: a bridge that has found a flight controller
gets it in simulated time.
"""

import math
import os
import random
import socket
import statistics
import struct
import tempfile
import threading
import time
import tracemalloc
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.idle import cpu_percents, listener, udpout
from benchmarks.processes import cpu_s, daemon, floor_program, simulated_naze
from benchmarks.station import drain
from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.gcs.station import Peer
from bridge.line.msp_link import byte_time_s
from bridge.model.events import BridgeEvent, FcFound
from bridge.vehicle.telemetry_table import TELEMETRY
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from simulator.board.flight import Craft, fly
from simulator.board.msp_port import MspAnswers, reply
from simulator.board.options import Tree

POLLS_HZ = 100
#: With the regular polls (STATUS 4 Hz, RC 2 Hz, three others 2.5 Hz) these make 100 polls per second.
_REQUESTED_HZ = {
    messages.MAVLINK_MSG_ID_ATTITUDE: 50,
    messages.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 21,
    messages.MAVLINK_MSG_ID_VFR_HUD: 21,
}
#: The polls' requests, for the floor.
_POLLS_HZ = {Msp.ATTITUDE: 50, Msp.RAW_GPS: 21, Msp.ALTITUDE: 21}
_ATTITUDES_HZ = 50
_ONLY_ATTITUDES_HZ = {row.msgid: 0 for row in TELEMETRY} | {messages.MAVLINK_MSG_ID_ATTITUDE: _ATTITUDES_HZ}
_SETTLING_S = 2.0
_WATCHED_S = 20
_ANSWERS = 1000
#: The daemon and the bare loop take turns, so that both see the same load of the machine.
_ANSWERS_A_TURN = 100
ATTITUDES = 1800
_NOISE_BYTES = 10_000_000
_CHUNK_BYTES = 1000
_SAMPLES = 100
_SEED = 1
_BAUD = 115200


def measure() -> list[Figure]:
    with tempfile.TemporaryDirectory() as name:
        return [_cpu(Path(name)), _attitude_cpu(Path(name)), *_latency(Path(name)), *_noise()]


def _cpu(folder: Path) -> Figure:
    with (
        simulated_naze(folder) as board,
        listener() as ground,
        daemon(folder, board.link, udpout(ground)) as process,
    ):
        process.wait_for_event("fc.found")
        request_rates(ground)
        (percent,) = cpu_percents(process.pid)
    return Figure(f"daemon at {POLLS_HZ} polls a second, CPU of one core", percent, "%", None, 5.0)


def _attitude_cpu(folder: Path) -> Figure:
    ours, bare = folder / "ours", folder / "bare"
    ours.mkdir()
    bare.mkdir()
    with (
        simulated_naze(ours) as board,
        simulated_naze(bare) as bare_board,
        listener() as ground,
        listener() as bare_ground,
        daemon(ours, board.link, udpout(ground)) as process,
        _bare_loop(bare, bare_board.link, bare_ground, {Msp.ATTITUDE: _ATTITUDES_HZ}) as bare_pid,
    ):
        process.wait_for_event("fc.found")
        _request(ground, _ONLY_ATTITUDES_HZ)
        time.sleep(_SETTLING_S)
        drain(ground)
        drain(bare_ground)
        pids = process.pid, bare_pid
        before = [cpu_s(pid) for pid in pids]
        count = bare_count = 0
        for _ in range(_WATCHED_S):
            time.sleep(1)
            count += _count_attitudes(ground)
            bare_count += _count_attitudes(bare_ground)
        ours_s, bare_s = (cpu_s(pid) - spent for pid, spent in zip(pids, before, strict=True))
    return Figure(
        f"CPU per attitude at {_ATTITUDES_HZ} Hz, polls included",
        ours_s / count * 1e6,
        "us",
        Floor(bare_s / bare_count * 1e6, "bare loop"),
        2.0,
        times_floor=True,
    )


def _latency(folder: Path) -> list[Figure]:
    ours_ms: list[float] = []
    bare_ms: list[float] = []
    with (
        instant_controller(folder / "instant") as controller,
        instant_controller(folder / "instant-bare") as bare_controller,
        listener() as ground,
        listener() as bare_ground,
        daemon(folder, folder / "instant", udpout(ground)) as process,
        _bare_loop(folder, folder / "instant-bare", bare_ground, _POLLS_HZ),
    ):
        process.wait_for_event("fc.found")
        request_rates(ground)
        time.sleep(_SETTLING_S)
        asked, began_at = controller.asked, time.perf_counter()
        while len(ours_ms) < _ANSWERS:
            ours_ms += _latencies_ms(ground, controller)
            bare_ms += _latencies_ms(bare_ground, bare_controller)
        polls_hz = (controller.asked - asked) / (time.perf_counter() - began_at)
    median = Floor(statistics.median(bare_ms), "bare loop")
    p99 = Floor(_p99(bare_ms), "bare loop")
    return [
        Figure(f"polls missing of {POLLS_HZ} a second", max(POLLS_HZ - polls_hz, 0.0), "", None, 0.05 * POLLS_HZ),
        Figure(
            f"reply to datagram, median of {_ANSWERS}", statistics.median(ours_ms), "ms", median, 2.0, times_floor=True
        ),
        Figure("reply to datagram, p99", _p99(ours_ms), "ms", p99, 2.0),
    ]


@contextmanager
def _bare_loop(folder: Path, link: Path, ground: socket.socket, polls_hz: Mapping[Msp, float]) -> Iterator[int]:
    """Run the floor; yields its process id."""
    rates = [f"{command:d}={rate_hz}" for command, rate_hz in polls_hz.items()]
    with floor_program(folder, "attitude", str(link), str(ground.getsockname()[1]), *rates) as (pid, _):
        yield pid


def _latencies_ms(ground: socket.socket, controller: "Controller") -> list[float]:
    """The delays of the next attitudes."""
    drain(ground)
    return [_wait_for_attitude(ground, controller) * 1000 for _ in range(_ANSWERS_A_TURN)]


def _p99(values: list[float]) -> float:
    return statistics.quantiles(values, n=100)[98]


def _noise() -> list[Figure]:
    chance = random.Random(_SEED)
    events: list[BridgeEvent] = []
    now = 0.0
    bridge = Bridge(BridgeConfig((_BAUD,)), events.append, now)
    bridge.fc_opened(now)
    ground, controller = Peer("udp", "noise"), Controller()
    while not any(isinstance(event, FcFound) for event in events):
        now += 0.01
        bridge.tick(now)
        for data in output.data if (output := bridge.take_fc_output()) else ():
            bridge.fc_received(b"".join(controller.answers(data)), now)
    bridge.gcs_received(ground, _frame(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)), now, datagram=True)
    events.clear()
    false_frames = 0
    memory: list[int] = []
    tracemalloc.start()
    chunks = _NOISE_BYTES // _CHUNK_BYTES
    for number in range(chunks):
        now += _CHUNK_BYTES * byte_time_s(_BAUD)
        bridge.fc_received(chance.randbytes(_CHUNK_BYTES), now)
        bridge.tick(now)
        bridge.take_fc_output()
        frames = MavlinkSplitter().feed(b"".join(data for _, data in bridge.take_datagrams()))
        false_frames += sum(frame.msgid == messages.MAVLINK_MSG_ID_ATTITUDE for frame in frames)
        if number % (chunks // _SAMPLES) == 0:
            memory.append(tracemalloc.get_traced_memory()[0])
        bridge.gcs_received(ground, _frame(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)), now, datagram=True)
    tracemalloc.stop()
    tenth = _SAMPLES // 10
    growth_kb = (max(memory[-tenth:]) - max(memory[:tenth])) / 1000
    size = f"{_NOISE_BYTES / 1e6:.0f} MB of noise"
    return [
        Figure(f"protocols found in {size}", sum(isinstance(event, FcFound) for event in events), "", None, 0),
        Figure(f"attitudes decoded from {size}", false_frames, "", None, 0),
        Figure(f"memory gained over {size}", growth_kb, "kB", None, 64),
    ]


def request_rates(ground: socket.socket) -> None:
    """Request the rates for 100 polls a second, as a ground station does."""
    _request(ground, _REQUESTED_HZ)


def _request(ground: socket.socket, rates_hz: Mapping[int, float]) -> None:
    """Request message rates; 0: never."""
    _, sender = ground.recvfrom(2048)
    for msgid, rate_hz in rates_hz.items():
        interval_us = 1e6 / rate_hz if rate_hz else -1
        request = messages.MAVLink_command_long_message(1, 1, 511, 0, msgid, interval_us, 0, 0, 0, 0, 0)
        ground.sendto(_frame(request), sender)


def _frame(message: Message) -> bytes:
    return FrameWriter(255, 190).frame(pack(message), 2)


def _count_attitudes(ground: socket.socket) -> int:
    """Read the datagrams received so far; returns how many attitudes they hold."""
    ground.setblocking(False)
    count = 0
    try:
        while True:
            frames = MavlinkSplitter().feed(ground.recv(2048))
            count += sum(frame.msgid == messages.MAVLINK_MSG_ID_ATTITUDE for frame in frames)
    except BlockingIOError:
        return count


def _wait_for_attitude(ground: socket.socket, controller: "Controller") -> float:
    """The delay of the next attitude, seconds."""
    while True:
        data = ground.recv(2048)
        received_at = time.perf_counter()
        for frame in MavlinkSplitter().feed(data):
            if frame.msgid == messages.MAVLINK_MSG_ID_ATTITUDE:
                (roll,) = struct.unpack_from("<f", frame.payload, 4)
                return received_at - controller.attitudes_at[round(math.degrees(roll) * 10) % ATTITUDES]


class Controller:
    """A flight controller that replies at once. `attitudes_at`: when each attitude (its roll) was sent."""

    def __init__(self) -> None:
        self.asked = 0
        self.attitudes_at = [0.0] * ATTITUDES
        self._parser = MspParser()
        self._answers = MspAnswers(lambda: Craft(fly(1.0, 0.0, armed=False), False, 1, None), Tree.TESTCODE3)
        self._number = 0

    def answers(self, data: bytes) -> Iterator[bytes]:
        """The replies to the requests in `data`."""
        for request in self._parser.feed(data):
            self.asked += 1
            if request.command == Msp.ATTITUDE:
                self._number = (self._number + 1) % ATTITUDES
                attitude = reply(request.command, struct.pack("<4h", self._number, 0, 0, 0))
                self.attitudes_at[self._number] = time.perf_counter()
                yield attitude
            else:
                yield self._answers.answer(request.command, request.payload)


@contextmanager
def instant_controller(link: Path) -> Iterator[Controller]:
    """Run one on a pseudo-terminal: each reply is ready at once, but only after the previous one has been sent."""
    near, far = os.openpty()
    tty.setraw(far)
    link.symlink_to(os.ttyname(far))
    controller = Controller()

    def serve() -> None:
        while data := os.read(near, 4096):
            for answer in controller.answers(data):
                os.write(near, answer)
                time.sleep(len(answer) * byte_time_s(_BAUD))

    # Ends with the process: the terminal is never closed while it waits for a byte.
    threading.Thread(target=serve, daemon=True).start()
    yield controller
