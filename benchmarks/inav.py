# SPDX-License-Identifier: GPL-3.0-or-later
"""A push of 120 records to INAV, each read back: over TCP against a bare loop of the same frames, and on a UART.

The bare loop sends a frame and waits for its reply: no parser, telemetry or event loop. It and the daemon take turns
with the same simulated INAV in another process (one client at a time), so that both see the same load of the machine.
On the UART it shows the delay of the simulated line itself. The daemon runs on this process's event loop; the clock is
read within the conversation, from the proof of the first record to that of the last, plus one record's share for the
first. SAVE, during which the board stalls for its flash, is not included.
"""

import asyncio
import os
import socket
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.processes import BenchmarkError, inav_on_a_socket, inav_on_a_uart
from bridge.controllers.nav.check import NavRules
from bridge.controllers.nav.rules import inav_profile
from bridge.missions.list_check import check_list
from bridge.model.refusal import Refusal
from protocols.mission_item import Command, Frame, MissionItem
from protocols.msp.frame import FRAME_OVERHEAD
from protocols.msp.nav import WP_SIZE, NavRecord, encode_read_wp, encode_set_wp
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import FcAddress, GcsAddress, SerialFc, TcpFc
from tests.support.inside import inside
from tests.support.programs import free_port

_COUNT = 120
_ROUNDS, _RUNS = 3, 5
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
                    _bare_loop(connection.sendall, connection.recv, _records(turn * _RUNS + run))
                    for run in range(_RUNS)
                ]
            whole += asyncio.run(_push_all(TcpFc(host, port), turn))
    name = f"{_COUNT} records to INAV over TCP, each read back, {_ROUNDS * _RUNS} runs"
    floor = Floor(statistics.median(bare) * 1000, "a bare loop of the same frames")
    return [
        Figure(f"{name}, median", statistics.median(whole) * 1000, "ms", floor, 1.3, times_floor=True),
        Figure(f"{name}, worst", max(whole) * 1000, "ms", Floor(max(bare) * 1000, "the bare loop's")),
    ]


def _over_a_uart() -> list[Figure]:
    with tempfile.TemporaryDirectory() as name, inav_on_a_uart(Path(name)) as fc:
        line = os.open(fc, os.O_RDWR | os.O_NOCTTY)
        bare = [_bare_loop(partial(_write_all, line), partial(os.read, line), _records(run)) for run in range(_RUNS)]
        os.close(line)
        times = asyncio.run(_push_all(SerialFc(fc, _BAUD), 1))
    floor = Floor(_WIRE_S * 1000, f"{_BYTES} bytes at {_BAUD} 8N1")
    name = f"{_COUNT} records to INAV at {_BAUD} baud, each read back, {_RUNS} runs"
    return [
        Figure(f"{name}, median", statistics.median(times) * 1000, "ms", floor, 1.15, times_floor=True),
        Figure(f"{name}, worst", max(times) * 1000, "ms", floor),
        Figure(
            "a bare loop on that line: what line and machine take of it, median",
            statistics.median(bare) * 1000,
            "ms",
            floor,
        ),
    ]


def _records(seed: int) -> tuple[NavRecord, ...]:
    items = [
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
    records: tuple[NavRecord, ...] = check_list(items, NavRules(inav_profile())).records
    assert len(records) == _COUNT
    return records


def _bare_loop(send: Callable[[bytes], None], read: Callable[[int], bytes], records: tuple[NavRecord, ...]) -> float:
    began = time.monotonic()
    for number, record in enumerate(records, 1):
        for frame, answer in (
            (encode_set_wp(number, record), FRAME_OVERHEAD),
            (encode_read_wp(number), FRAME_OVERHEAD + WP_SIZE),
        ):
            send(frame)
            left = answer
            while left:
                left -= len(read(left))
    return time.monotonic() - began


def _write_all(line: int, data: bytes) -> None:
    os.write(line, data)


async def _push_all(fc: FcAddress, turn: int) -> list[float]:
    daemon = Daemon(Settings(fc, [GcsAddress("udpout", "127.0.0.1", free_port())]))
    running = asyncio.create_task(daemon.run())
    try:
        while isinstance(inside(daemon.bridge).missions.fc_store, Refusal) or daemon.bridge.is_busy:  # noqa: ASYNC110 - as in push
            await asyncio.sleep(0.01)
        return [await _push(daemon, _records(turn * _RUNS + run)) for run in range(_RUNS)]
    finally:
        running.cancel()
        await asyncio.wait([running])


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
