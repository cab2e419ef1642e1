# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of telemetry over MSP: CPU at 100 polls per second, the time from a reply to its datagram, and noise.

CPU: the daemon polls a simulated Naze that keeps the pace of a UART, and sends the 100 datagrams per second that one
ground station requested. Latency: the other end of the terminal is in this process and replies at once; each attitude
is numbered, so that a datagram is matched with its reply. Noise needs no port: a bridge that has found a flight
controller gets it in simulated time.
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
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figure import Figure
from benchmarks.idle import cpu_percent, listener, udpout
from benchmarks.processes import BenchmarkError, daemon, simulated_naze
from bridge.bridge import Bridge
from bridge.config import BridgeConfig
from bridge.gcs.station import Peer
from bridge.model.events import Level
from protocols.mavlink.codec import FrameWriter, pack
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkSplitter
from protocols.msp.commands import Msp
from protocols.msp.frame import MspParser
from simulator.flight import Craft, fly
from simulator.msp_port import MspAnswers, reply
from simulator.options import Tree

POLLS_HZ = 100
#: With the regular polls (STATUS 4 Hz, RC 2 Hz, three others 2.5 Hz) these make 100 polls per second.
_WISHES_HZ = {
    messages.MAVLINK_MSG_ID_ATTITUDE: 50,
    messages.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 21,
    messages.MAVLINK_MSG_ID_VFR_HUD: 21,
}
_SETTLING_S = 2.0
_ANSWERS = 2000
ATTITUDES = 1800
_NOISE_BYTES = 10_000_000
_CHUNK_BYTES = 1000
_SAMPLES = 100
_SEED = 1


def measure() -> list[Figure]:
    """Measure all three."""
    with tempfile.TemporaryDirectory() as name:
        return [_cpu(Path(name)), *_latency(Path(name)), *_noise()]


def _cpu(folder: Path) -> Figure:
    with (
        simulated_naze(folder) as board,
        listener() as ground,
        daemon(folder, board.link, udpout(ground)) as process,
    ):
        process.wait_for_event("fc.found")
        wish(ground)
        percent = cpu_percent(process.pid)
    return Figure(f"daemon at {POLLS_HZ} polls a second, CPU of one core", percent, "%", None, 5.0)


def _latency(folder: Path) -> list[Figure]:
    with (
        instant_controller(folder / "instant") as controller,
        listener() as ground,
        daemon(folder, folder / "instant", udpout(ground)) as process,
    ):
        process.wait_for_event("fc.found")
        wish(ground)
        time.sleep(_SETTLING_S)
        drain(ground)
        asked, began_at = controller.asked, time.perf_counter()
        milliseconds = sorted(_wait_for_attitude(ground, controller) * 1000 for _ in range(_ANSWERS))
        polls_hz = (controller.asked - asked) / (time.perf_counter() - began_at)
    if polls_hz < 0.95 * POLLS_HZ:
        raise BenchmarkError(f"only {polls_hz:.0f} polls a second were asked")
    p99 = milliseconds[int(len(milliseconds) * 0.99)]
    return [
        Figure("polls a second that it was measured at", polls_hz, ""),
        Figure(f"reply to datagram, median of {_ANSWERS}", statistics.median(milliseconds), "ms"),
        Figure("reply to datagram, p99", p99, "ms", None, 2.0),
    ]


def _noise() -> list[Figure]:
    chance = random.Random(_SEED)
    events: list[str] = []

    def log_event(_level: Level, event: str, /, **_facts: object) -> None:
        events.append(event)

    now = 0.0
    bridge = Bridge(BridgeConfig((115200,)), log_event, now)
    bridge.session.opened(now)
    ground, controller = Peer("udp", "noise"), Controller()
    while "fc.found" not in events:
        now += 0.01
        bridge.tick(now)
        for data in bridge.take_fc_output():
            bridge.fc_received(controller.answer(data), now)
    bridge.gcs_received(ground, _frame(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)), now, datagram=True)
    events.clear()
    false_frames = 0
    memory: list[int] = []
    tracemalloc.start()
    chunks = _NOISE_BYTES // _CHUNK_BYTES
    for number in range(chunks):
        now += _CHUNK_BYTES * 10 / 115200
        bridge.fc_received(chance.randbytes(_CHUNK_BYTES), now)
        bridge.tick(now)
        bridge.take_fc_output()
        kinds = [MavlinkSplitter().feed(frame)[0].msgid for _, frame in bridge.ground.take_datagrams()]
        false_frames += sum(msgid == messages.MAVLINK_MSG_ID_ATTITUDE for msgid in kinds)
        if number % (chunks // _SAMPLES) == 0:
            memory.append(tracemalloc.get_traced_memory()[0])
        bridge.gcs_received(ground, _frame(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)), now, datagram=True)
    tracemalloc.stop()
    tenth = _SAMPLES // 10
    growth_kb = (max(memory[-tenth:]) - max(memory[:tenth])) / 1000
    size = f"{_NOISE_BYTES / 1e6:.0f} MB of noise"
    return [
        Figure(f"protocols found in {size}", events.count("fc.found"), "", None, 0),
        Figure(f"attitudes made of {size}", false_frames, "", None, 0),
        Figure(f"memory gained over {size}", growth_kb, "kB", None, 64),
    ]


def wish(ground: socket.socket) -> None:
    """Request the rates, as a ground station does."""
    _, sender = ground.recvfrom(2048)
    for msgid, rate_hz in _WISHES_HZ.items():
        wish = messages.MAVLink_command_long_message(1, 1, 511, 0, msgid, 1e6 / rate_hz, 0, 0, 0, 0, 0)
        ground.sendto(_frame(wish), sender)


def _frame(message: messages.MAVLink_message) -> bytes:
    return FrameWriter(255, 190).frame(pack(message), 2)


def drain(ground: socket.socket) -> None:
    """Read all datagrams received so far, and the following ones."""
    ground.setblocking(False)
    try:
        while True:
            ground.recv(2048)
    except BlockingIOError:
        ground.settimeout(10)


def _wait_for_attitude(ground: socket.socket, controller: "Controller") -> float:
    """The delay of the next attitude, seconds."""
    while True:
        data = ground.recv(2048)
        came_at = time.perf_counter()
        for frame in MavlinkSplitter().feed(data):
            if frame.msgid == messages.MAVLINK_MSG_ID_ATTITUDE:
                (roll,) = struct.unpack_from("<f", frame.payload, 4)
                return came_at - controller.attitudes_at[round(math.degrees(roll) * 10) % ATTITUDES]


class Controller:
    """A flight controller that replies at once. `attitudes_at`: when each attitude (its roll) was sent."""

    def __init__(self) -> None:
        self.asked = 0
        self.attitudes_at = [0.0] * ATTITUDES
        self._parser = MspParser()
        self._answers = MspAnswers(lambda: Craft(fly(1.0, 0.0, armed=False), False, 1, None), Tree.TESTCODE3)
        self._number = 0

    def answer(self, data: bytes) -> bytes:
        """The replies to the requests in `data`."""
        replies = b""
        for request in self._parser.feed(data):
            self.asked += 1
            if request.command == Msp.ATTITUDE:
                self._number = (self._number + 1) % ATTITUDES
                replies += reply(request.command, struct.pack("<4h", self._number, 0, 0, 0))
                self.attitudes_at[self._number] = time.perf_counter()
            else:
                replies += self._answers.answer(request.command, request.payload)
        return replies


@contextmanager
def instant_controller(link: Path) -> Iterator[Controller]:
    """Run one behind a pseudo-terminal."""
    near, far = os.openpty()
    tty.setraw(far)
    link.symlink_to(os.ttyname(far))
    controller = Controller()

    def serve() -> None:
        while data := os.read(near, 4096):
            os.write(near, controller.answer(data))

    # Ends with the process: the terminal is never closed while it waits for a byte.
    threading.Thread(target=serve, daemon=True).start()
    yield controller
