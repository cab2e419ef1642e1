# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner over loopback UDP: the time to connect, and the time to write 146 items.

It is the tests' scripted Mission Planner, at its own pace. The floor of a write is the same client's write to a vehicle
that stores nothing (benchmarks.floors), plus the time of the records' bytes at line rate. The two take turns. The
board's flash takes no time, as in benchmarks.push: a real one erases for 100 ms.
"""

import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.figure import Figure, Floor
from benchmarks.missions import COUNT
from benchmarks.processes import daemon, floor_program, simulated_naze, wait_for
from protocols.mission_item import MissionResult
from protocols.msp.mission import RECORD_SIZE
from tests.support.mission_planner import MissionPlanner
from tests.support.plan import plain_plan
from tests.support.programs import free_port

_RUNS = 7
_NO_FLASH_TIME = ("--flash-stall", "0", "--program-stall", "0")
_LINE_S = COUNT * RECORD_SIZE * 10 / 115200


def measure() -> list[Figure]:
    """Measure several connections, each followed by a write."""
    connects_s: list[float] = []
    writes_s: list[float] = []
    floors_s: list[float] = []
    port = free_port()
    with (
        TemporaryDirectory() as name,
        simulated_naze(Path(name), *_NO_FLASH_TIME) as board,
        floor_program(Path(name), "vehicle") as (_, log),
    ):
        wait_for(lambda: log.read_bytes().endswith(b"\n"), "the ideal vehicle is up")
        ideal_port = int(log.read_text())
        with daemon(Path(name), board.link, f"udpin:127.0.0.1:{port}") as process:
            process.wait_for_event("fc.found")
            for run in range(_RUNS):
                with MissionPlanner(("127.0.0.1", port)) as planner:
                    began_at = time.perf_counter()
                    planner.connect()
                    connects_s.append(time.perf_counter() - began_at)
                    writes_s.append(_write(planner, run))
                with MissionPlanner(("127.0.0.1", ideal_port)) as planner:
                    planner.wait_for_vehicle()
                    floors_s.append(_write(planner, run))
    floor = Floor(statistics.median(floors_s) + _LINE_S, "ideal vehicle and bytes at line rate")
    name = f"Mission Planner's Write of {COUNT} items, median of {_RUNS}"
    return [
        Figure(f"Mission Planner connects, median of {_RUNS}", statistics.median(connects_s), "s", None, 1.1),
        Figure(name, statistics.median(writes_s), "s", floor, 1.6, times_floor=True),
    ]


def _write(planner: MissionPlanner, run: int) -> float:
    """Write a list; returns the seconds until the final ack."""
    began_at = time.perf_counter()
    planner.write(plain_plan(COUNT, start=run * COUNT))
    planner.wait_for_ack(MissionResult.ACCEPTED)
    return time.perf_counter() - began_at
