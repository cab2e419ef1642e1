# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions of 120 items to INAV: over TCP a whole Write against a bare loop of the same frames, and on a UART.

The bare loop sends a frame and waits for its reply, each record and its read-back, and SAVE: no parser, telemetry,
event loop or disk. It and the daemon take turns with the same INAV in another process (one client at a time), so that
both see the same load of the machine. The daemon runs on this process's event loop, with a mission store in a folder.
Its time is that of a Write after the last item: the check, the store, each record and its read-back, SAVE, the
verification after it, and the outcome in the store. INAV is the simulated one, or with INAV_SITL=PATH INAV's own
simulator, whose port 5760 must be free.

On the UART, SAVE, during which the board stalls for its flash, is not included: the clock is read within the
conversation, from the proof of the first record to that of the last, plus one record's share for the first. The bare
loop shows the delay of the simulated line itself.
"""

import asyncio
import os
import socket
import statistics
import tempfile
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.processes import BenchmarkError, inav_on_a_socket, inav_on_a_uart
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import inav_profile
from bridge.missions.list_check import check_list
from bridge.missions.mission_service import DeliveryResult
from bridge.model.refusal import Refusal
from protocols.mission_item import Command, Frame, MissionItem, MissionResult
from protocols.msp.frame import FRAME_OVERHEAD
from protocols.msp.nav import SAVE_REQUEST, WP_SIZE, NavRecord, encode_read_wp, encode_set_wp
from service.daemon.daemon import Daemon
from service.machine import event_loop
from service.settings import Settings
from service.settings.addresses import FcAddress, GcsAddress, SerialFc, TcpFc
from tests.support.inside import inside
from tests.support.programs import free_port

_COUNT = 120
_ROUNDS, _RUNS = 6, 5
_BAUD = 115200
_BYTES = _COUNT * (WP_SIZE + 1 + WP_SIZE + 4 * FRAME_OVERHEAD)
_WIRE_S = _BYTES * 10 / _BAUD


def measure() -> list[Figure]:
    return [*_over_tcp(), *_over_a_uart()]


def _over_tcp() -> list[Figure]:
    bare, whole = [], []
    with tempfile.TemporaryDirectory() as name, inav_on_a_socket(Path(name)) as (host, port):
        for turn in range(_ROUNDS):
            with socket.create_connection((host, port)) as connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                bare += [
                    _bare_loop(connection.sendall, connection.recv, _records(turn * _RUNS + run), saves=True)
                    for run in range(_RUNS)
                ]
            whole += event_loop.run(_write_all_missions(TcpFc(host, port), Path(name), turn))
    name = f"Write of {_COUNT} items to INAV over TCP, from the last item to the ack, {_ROUNDS * _RUNS} runs"
    floor = Floor(statistics.median(bare) * 1000, "a bare loop: write, read back, save")
    worst = Floor(max(bare) * 1000, "the bare loop's")
    return [
        Figure(f"{name}, median", statistics.median(whole) * 1000, "ms", floor, 1.3, times_floor=True),
        Figure(f"{name}, worst", max(whole) * 1000, "ms", worst, 1.3, times_floor=True),
    ]


def _over_a_uart() -> list[Figure]:
    with tempfile.TemporaryDirectory() as name, inav_on_a_uart(Path(name)) as fc:
        line = os.open(fc, os.O_RDWR | os.O_NOCTTY)
        bare = [_bare_loop(partial(_send_all, line), partial(os.read, line), _records(run)) for run in range(_RUNS)]
        os.close(line)
        times = event_loop.run(_push_all(SerialFc(fc, _BAUD), 1))
    floor = Floor(_WIRE_S * 1000, f"{_BYTES} bytes at {_BAUD} 8N1")
    name = f"{_COUNT} records to INAV at {_BAUD} baud, each read back, {_RUNS} runs"
    return [
        Figure(f"{name}, median", statistics.median(times) * 1000, "ms", floor, 1.15, times_floor=True),
        Figure(f"{name}, worst", max(times) * 1000, "ms", floor),
        Figure(
            "a bare loop on that line, median",
            statistics.median(bare) * 1000,
            "ms",
            floor,
        ),
    ]


def _items(seed: int) -> list[MissionItem]:
    return [
        MissionItem(
            n,
            Command.NAV_WAYPOINT,
            Frame.GLOBAL_RELATIVE_ALT,
            0,
            0,
            0,
            0,
            473_977_000 + 997 * n + seed,
            85_456_000,
            30.0,
        )
        for n in range(_COUNT + 1)
    ]


def _records(seed: int) -> tuple[NavRecord, ...]:
    records: tuple[NavRecord, ...] = check_list(_items(seed), NavRules(inav_profile())).records
    assert len(records) == _COUNT
    return records


def _bare_loop(
    send: Callable[[bytes], None], read: Callable[[int], bytes], records: tuple[NavRecord, ...], *, saves: bool = False
) -> float:
    frames = [
        frame
        for number, record in enumerate(records, 1)
        for frame in ((encode_set_wp(number, record), 0), (encode_read_wp(number), WP_SIZE))
    ]
    began = time.monotonic()
    for frame, answer in [*frames, (SAVE_REQUEST, 0)] if saves else frames:
        send(frame)
        left = FRAME_OVERHEAD + answer
        while left:
            left -= len(read(left))
    return time.monotonic() - began


def _send_all(line: int, data: bytes) -> None:
    os.write(line, data)


@asynccontextmanager
async def _ready_daemon(fc: FcAddress, state_dir: Path | None = None) -> AsyncIterator[Daemon]:
    """A daemon that has found its flight controller."""
    daemon = Daemon(Settings(fc, [GcsAddress("udpout", "127.0.0.1", free_port())], state_dir=state_dir))
    running = asyncio.create_task(daemon.run())
    try:
        while isinstance(inside(daemon.bridge).missions.fc_store, Refusal) or daemon.bridge.is_busy:  # noqa: ASYNC110 - as in push
            await asyncio.sleep(0.01)
        yield daemon
    finally:
        running.cancel()
        await asyncio.wait([running])


async def _write_all_missions(fc: FcAddress, state_dir: Path, turn: int) -> list[float]:
    async with _ready_daemon(fc, state_dir) as daemon:
        return [await _write_mission(daemon, _items(turn * _RUNS + run)) for run in range(_RUNS)]


async def _write_mission(daemon: Daemon, items: list[MissionItem]) -> float:
    """Write one mission; returns the seconds from the call to the result."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[DeliveryResult | Refusal] = loop.create_future()
    began = loop.time()
    daemon.bridge.missions.push(items, "benchmark", lambda _: None, lambda result, _: done.set_result(result), began)
    daemon.flush()
    result = await done
    if result.ack is not MissionResult.ACCEPTED:
        raise BenchmarkError(f"the mission was refused: {result.text}")
    return loop.time() - began


async def _push_all(fc: FcAddress, turn: int) -> list[float]:
    async with _ready_daemon(fc) as daemon:
        return [await _push(daemon, _records(turn * _RUNS + run)) for run in range(_RUNS)]


async def _push(daemon: Daemon, records: tuple[NavRecord, ...]) -> float:
    """Push one list; returns the seconds from the first record's frame to the proof of the last."""
    loop = asyncio.get_running_loop()
    fc_store = inside(daemon.bridge).missions.fc_store
    assert not isinstance(fc_store, Refusal)
    proven_at: list[float] = []
    done: asyncio.Future[object] = loop.create_future()
    push = fc_store.push(records, lambda _number: proven_at.append(loop.time()))
    inside(daemon.bridge).runner.start(push, lambda result, _: done.set_result(result), loop.time())
    daemon.flush()
    result = await done
    if len(proven_at) != _COUNT or getattr(result, "failure", True):
        raise BenchmarkError(f"the push ended with {result}")
    # Plus the share of the first one, estimated from the others.
    return (proven_at[-1] - proven_at[0]) * _COUNT / (_COUNT - 1)
