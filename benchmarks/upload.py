# SPDX-License-Identifier: GPL-3.0-or-later
"""An upload of 146 items over loopback UDP: from a station that replies at once, over a slow link, to a slow flash.

The daemon, the simulated Naze behind its pseudo-terminal, and the echo server for the floor run in separate processes;
the ground station is this one. A step begins when an item leaves the socket and ends with the arrival of the request
for the next one, so any time above the echo's is the daemon's own. The echo gets datagrams of an item's size.
"""

import statistics
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.missions import COUNT, random_mission
from benchmarks.processes import daemon, floor_program, simulated_naze, wait_for
from benchmarks.station import Station
from tests.support.programs import free_port

_UPLOADS = 10
_SLOW_UPLOADS = 5
_ROUND_TRIP_S = 0.020
_FLASH_STALL_MS = 300
_LINE_MS = COUNT * 16 * 10 / 115.2
#: MISSION_ITEM_INT in MAVLink 2, without its trailing zeros.
_ITEM_SIZE = 48


def measure() -> list[Figure]:
    """Measure several uploads of each kind."""
    with tempfile.TemporaryDirectory() as name, floor_program(Path(name), "echo") as (_, log):
        wait_for(lambda: log.read_bytes().endswith(b"\n"), "the echo server is up")
        echo_port = int(log.read_text())
        return [*_steps(echo_port), *_slow_link(echo_port), *_slow_flash()]


def _steps(echo_port: int) -> list[Figure]:
    with _bridge() as port, _station(port) as station:
        uploads = [station.upload(random_mission(seed)) for seed in range(_UPLOADS)]
    steps_ms = [step * 1000 for upload in uploads for step in upload.steps]
    with _station(echo_port) as station:
        echoes_ms = [station.echo(_ITEM_SIZE) * 1000 for _ in steps_ms]
    step_ms, echo_ms = statistics.median(steps_ms), statistics.median(echoes_ms)
    name = f"upload, item to next request, {len(steps_ms)} steps"
    return [
        Figure(f"{name}, median", step_ms, "ms", Floor(echo_ms, "echo over UDP")),
        Figure(f"{name}, worst of 100", _percentile_99(steps_ms), "ms", Floor(_percentile_99(echoes_ms), "the echo's")),
        Figure("upload, the daemon's own part of a step, median", step_ms - echo_ms, "ms", None, 1.0),
    ]


def _slow_link(echo_port: int) -> list[Figure]:
    """Alternate with the floor: both see the same load of the machine.

    The station waits before it sends, and for the answer to the last item, too: the final ack comes after all 147.
    """
    floors_s, totals_s = [], []
    with _bridge() as port, _station(port, _ROUND_TRIP_S) as station, _station(echo_port, _ROUND_TRIP_S) as echo:
        for seed in range(_SLOW_UPLOADS):
            floors_s.append(sum(echo.echo(_ITEM_SIZE) + _ROUND_TRIP_S for _ in range(COUNT + 1)))
            totals_s.append(station.upload(random_mission(seed)).total + _ROUND_TRIP_S)
    name = f"upload at {_ROUND_TRIP_S * 1000:.0f} ms round trip, count to final ack, median of {_SLOW_UPLOADS}"
    floor = Floor(statistics.median(floors_s) * 1000, f"{COUNT + 1} echoes")
    return [Figure(name, statistics.median(totals_s) * 1000, "ms", floor, 1.15, times_floor=True)]


def _slow_flash() -> list[Figure]:
    with _bridge("--flash-stall", str(_FLASH_STALL_MS)) as port, _station(port) as station:
        worst_s = max(station.upload(random_mission(seed)).last_item_to_ack for seed in range(_SLOW_UPLOADS))
    name = f"last item to final ack, flash stall {_FLASH_STALL_MS} ms, worst of {_SLOW_UPLOADS}"
    floor = Floor(_FLASH_STALL_MS + _LINE_MS, "stall and bytes at line rate")
    return [Figure(name, worst_s * 1000, "ms", floor, 2000)]


@contextmanager
def _bridge(*sim_options: str) -> Iterator[int]:
    """Run daemon and flight controller; yields the port for ground stations once the daemon has found it."""
    port = free_port()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with (
            simulated_naze(folder, *sim_options) as board,
            daemon(folder, board.link, f"udpin:127.0.0.1:{port}") as process,
        ):
            process.wait_for_event("fc.found")
            yield port


@contextmanager
def _station(port: int, link_s: float = 0.0) -> Iterator[Station]:
    station = Station(port, link_s)
    try:
        yield station
    finally:
        station.close()


def _percentile_99(values: list[float]) -> float:
    return statistics.quantiles(values, n=100)[98]
