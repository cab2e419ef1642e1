# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of zenoh for the daemon: latency, CPU per sample, CPU without subscribers, memory.

Latency: from a flight controller's reply at the other end of the terminal to the callback of a subscriber, both in this
process, with the daemon and the router in two others; the floor is a bare put through the same router. CPU: the
daemon's own parts in this process, fed step by step, with a subscriber in another; rounds of our samples, of bare puts
of the same bytes, and of neither alternate, and the cost of the last is subtracted from both.
"""

import asyncio
import json
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import zenoh

from benchmarks.figure import Figure, Floor
from benchmarks.idle import LIBRARIES, libraries_mb, listener, resident_mb, udpout
from benchmarks.processes import BenchmarkError, daemon, running, wait_for
from benchmarks.station import drain
from benchmarks.telemetry import ATTITUDES, POLLS_HZ, Controller, instant_controller, request_rates
from benchmarks.zenoh_programs import ALL_TELEMETRY, configuration
from bridge.model.vehicle import Orientation
from payloads.keys import TELEMETRY, full
from payloads.names import DEFAULT_PREFIX
from reports.vehicle_groups import Group
from service.daemon.daemon import Daemon
from service.machine import event_loop
from service.settings import Settings
from service.settings.addresses import parse_fc
from service.settings.zenoh import ZenohSettings
from service.settings.zenoh_config import make_config
from service.zenoh_link.node import Node
from tests.support.zenoh_router import client, running_router

_VEHICLE = "naze"
_SETTLING_S = 2.0
_WATCHED_S = 15.0
_RATE_HZ = 100
_TURN = 100
_TURNS = 8
_ANSWERS_A_TURN = 2000


def measure() -> list[Figure]:
    with tempfile.TemporaryDirectory() as name, running_router(Path(name)) as router:
        folder, endpoint = Path(name), router.endpoint
        return [*_latency_and_memory(folder, endpoint), *event_loop.run(_cpu(folder, endpoint))]


def _latency_and_memory(folder: Path, endpoint: str) -> list[Figure]:
    bare_ms = sorted(_bare_latencies_ms(folder, endpoint))
    milliseconds: list[float] = []
    samples: list[float] = []
    config = configuration(folder, _VEHICLE, endpoint)
    with (
        instant_controller(folder / "instant") as controller,
        listener() as ground,
        daemon(folder, folder / "instant", udpout(ground), "--config", str(config)) as process,
        client(endpoint) as session,
    ):
        process.wait_for_event("fc.found")
        request_rates(ground)

        def received(sample: zenoh.Sample) -> None:
            received_at = time.perf_counter()
            samples.append(received_at)
            if str(sample.key_expr).endswith("/attitude"):
                number = round(json.loads(sample.payload.to_bytes())["roll_deg"] * 10) % ATTITUDES
                milliseconds.append((received_at - controller.attitudes_at[number]) * 1000)

        with session.declare_subscriber(full(DEFAULT_PREFIX, _VEHICLE, ALL_TELEMETRY), received):
            time.sleep(_SETTLING_S)
            drain(ground)
            samples.clear()
            milliseconds.clear()
            time.sleep(_WATCHED_S)
            rate_hz = len(samples) / _WATCHED_S
            found = sorted(milliseconds)
        memory_mb = resident_mb(process.pid)
    # Some replies, as to IDENT, belong to no group.
    if rate_hz < 0.5 * POLLS_HZ:
        raise BenchmarkError(f"only {rate_hz:.0f} samples a second arrived")
    floor = "a bare put through the router"
    libraries = f"{LIBRARIES}; import zenoh, cbor2"
    return [
        Figure("samples a second during the measurement", rate_hz, ""),
        Figure("reply to subscriber, median", statistics.median(found), "ms", Floor(statistics.median(bare_ms), floor)),
        Figure("reply to subscriber, p99", _p99(found), "ms", Floor(_p99(bare_ms), floor), 5.0),
        Figure("daemon with zenoh, resident", memory_mb, "MB", Floor(libraries_mb(libraries), "its libraries"), 70.0),
    ]


def _p99(ordered: list[float]) -> float:
    return ordered[int(len(ordered) * 0.99)]


_PUTTER = """
import json, struct, sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
session = zenoh.open(config)
publisher = session.declare_publisher("floor", congestion_control=zenoh.CongestionControl.DROP)
while True:
    publisher.put(struct.pack("<d", time.perf_counter()) + bytes(100))
    time.sleep(0.01)
"""


def _bare_latencies_ms(folder: Path, endpoint: str) -> list[float]:
    """The times of bare puts; on Linux perf_counter() is one clock for all processes."""
    found: list[float] = []

    def received(sample: zenoh.Sample) -> None:
        received_at = time.perf_counter()
        (put_at,) = struct.unpack_from("<d", sample.payload.to_bytes())
        found.append((received_at - put_at) * 1000)

    with (
        client(endpoint) as session,
        session.declare_subscriber("floor", received),
        running([sys.executable, "-c", _PUTTER, endpoint], folder / "putter.log"),
    ):
        wait_for(lambda: bool(found), "a bare put arrives")
        found.clear()
        time.sleep(_WATCHED_S / 3)
        return list(found)


async def _cpu(folder: Path, endpoint: str) -> list[Figure]:
    ours, without = (Daemon(Settings(parse_fc("sim:"))) for _ in range(2))
    fed = _Fed(ours)
    settings = ZenohSettings(vehicle=_VEHICLE, connect=(endpoint,))
    key = full(settings.prefix, _VEHICLE, TELEMETRY[Group.ATTITUDE].suffix)
    node = Node(settings, ours)
    node.start()
    try:
        unread = await _unread_us(fed, _Fed(without))
        with (
            zenoh.open(make_config(ZenohSettings(connect=(endpoint,)))) as session,
            session.declare_publisher("floor", congestion_control=zenoh.CongestionControl.DROP) as bare,
            running([sys.executable, "-c", _READER, endpoint, key, "floor"], folder / "reader.log"),
        ):
            payload = await _first_payload(node, endpoint, key)
            return [*await _sample_us(node, bare, payload), *unread]
    finally:
        await node.close()


async def _first_payload(node: Node, endpoint: str, key: str) -> bytes:
    """Publish until a subscriber has received a sample; returns what it received."""
    payloads: list[bytes] = []
    with (
        client(endpoint) as session,
        session.declare_subscriber(key, lambda sample: payloads.append(sample.payload.to_bytes())),
    ):
        while not payloads:
            node.telemetry(frozenset({Group.ATTITUDE}))
            await asyncio.sleep(0.05)
    await asyncio.sleep(_SETTLING_S)
    return payloads[0]


class _Fed:
    """A daemon with a scripted flight controller, in simulated time."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._controller = Controller()
        # An hour ahead: no timer of the loop runs before its simulated time.
        self._now = asyncio.get_running_loop().time() + 3600
        daemon.bridge.fc_opened(self._now)
        vehicle = daemon.bridge.vehicle
        while vehicle.last(Orientation) is None:
            self.step()

    def step(self) -> int:
        """Advance by 10 ms; returns the number of replies in it."""
        bridge, before = self._daemon.bridge, self._controller.asked
        self._now += 0.01
        bridge.tick(self._now)
        # A reply may trigger the next request; flush() would write it to a port that is not open.
        while (output := bridge.take_fc_output()) and output.data:
            bridge.fc_received(b"".join(self._controller.answers(b"".join(output.data))), self._now)
        self._daemon.flush()
        return self._controller.asked - before


async def _unread_us(with_zenoh: _Fed, without: _Fed) -> list[Figure]:
    await asyncio.sleep(_SETTLING_S)
    costs: tuple[list[float], list[float]] = ([], [])
    for _ in range(_TURNS):
        for fed, found in zip((with_zenoh, without), costs, strict=True):
            answers, began_at = 0, time.process_time()
            while answers < _ANSWERS_A_TURN:
                answers += fed.step()
            found.append((time.process_time() - began_at) / answers * 1e6)
            await asyncio.sleep(0)
    on, off = map(statistics.median, costs)
    return [
        Figure("a reply handled, zenoh on without subscribers, CPU", on, "us", Floor(off, "the same without zenoh")),
        Figure("the cost of zenoh there", max(on - off, 0.0), "us", None, 10.0),
    ]


_READER = """
import json, sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
session = zenoh.open(config)
readers = [session.declare_subscriber(key, lambda sample: None) for key in sys.argv[2:]]
time.sleep(1e6)
"""


async def _sample_us(node: Node, bare: zenoh.Publisher, payload: bytes) -> list[Figure]:
    async def turn(act: Callable[[], object]) -> float:
        began_at = time.process_time()
        for _ in range(_TURN):
            act()
            await asyncio.sleep(1 / _RATE_HZ)
        return (time.process_time() - began_at) / _TURN * 1e6

    attitude = frozenset({Group.ATTITUDE})
    acts: list[Callable[[], object]] = [lambda: node.telemetry(attitude), lambda: bare.put(payload), lambda: None]
    costs: list[list[float]] = [[], [], []]
    for _ in range(_TURNS):
        for act, found in zip(acts, costs, strict=True):
            found.append(await turn(act))
    ours, floor, neither = map(statistics.median, costs)
    return [
        Figure(
            f"a sample published, {_RATE_HZ} a second, CPU",
            ours - neither,
            "us",
            Floor(floor - neither, "a bare put of its bytes"),
            1.5,
            times_floor=True,
        )
    ]
