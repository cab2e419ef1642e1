# SPDX-License-Identifier: GPL-3.0-or-later
"""Forwarding MAVLink from the flight controller to a ground station: CPU time per message, latency, losses.

Each forwarder has its own pseudo-terminal and UDP port; flight controller and ground station are this process. The
forwarders take turns on one CPU, so that all see the same load of the machine.
"""

import os
import statistics
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.forwarders import (
    FLOOR,
    MAVLINK_ROUTER,
    OURS,
    Forwarder,
    usable_forwarders,
)
from benchmarks.line import Line, on_cpu
from benchmarks.processes import cpu_s

_ROUNDS = 3
#: 57600 baud carry about 150/s.
_RATES: dict[str, float | None] = {"150/s": 150.0, "500/s": 500.0, "3000/s": 3000.0, "unpaced": None}
_SETTLING_S = 0.5
_WATCHED_S = 2.0
#: The limits by rate, as multiples of other forwarders' figures. On a quiet machine, where a wake-up costs a C program
#: 10 us, the multiples are the largest: beside other work they were 1.3, 1.1 and 1.3.
_LIMITS: dict[str, dict[str, float]] = {
    "150/s": {MAVLINK_ROUTER: 3.5},
    "500/s": {MAVLINK_ROUTER: 2.5},
    "3000/s": {FLOOR: 2.2, MAVLINK_ROUTER: 2.0},
    "unpaced": {MAVLINK_ROUTER: 1.1},
}
_OTHERS = (FLOOR, MAVLINK_ROUTER)
#: At the lower rates, reads are gathered for up to 30 ms.
_MAX_P99_MS = {"150/s": 35.0, "500/s": 15.0, "3000/s": 3.0}


@dataclass(frozen=True, slots=True)
class _Run:
    """One forwarder at one rate: CPU time in microseconds per message, latency in ms."""

    cpu_us: float
    p99_ms: float
    lost: int


#: By forwarder and rate.
_Runs = dict[tuple[str, str], list[_Run]]


def measure() -> list[Figure]:
    """Measure all forwarders on this machine."""
    with on_cpu(min(os.sched_getaffinity(0))):
        runs = _rounds(usable_forwarders())
    return [figure for rate in _RATES for figure in _at(rate, runs)]


def _at(rate: str, runs: _Runs) -> Iterator[Figure]:
    ours = runs[OURS, rate]
    others = {name: runs[name, rate] for name in _OTHERS if (name, rate) in runs}
    for name, its_runs in others.items():
        floor, limit = Floor(_cpu_us(its_runs), name), _LIMITS[rate].get(name)
        yield Figure(f"forward at {rate}, CPU a message", _cpu_us(ours), "us", floor, limit, times_floor=True)
    floors = [Floor(_p99_ms(its_runs), name) for name, its_runs in others.items() if name == FLOOR]
    limit = _MAX_P99_MS.get(rate)
    yield Figure(f"forward at {rate}, latency, worst of 100", _p99_ms(ours), "ms", next(iter(floors), None), limit)
    yield Figure(f"forward at {rate}, lost", _lost(ours), "", None, 0)
    for name, its_runs in others.items():
        yield Figure(f"forward at {rate}, lost by {name}", _lost(its_runs), "")


def _cpu_us(runs: Sequence[_Run]) -> float:
    return statistics.median(run.cpu_us for run in runs)


def _p99_ms(runs: Sequence[_Run]) -> float:
    return statistics.median(run.p99_ms for run in runs)


def _lost(runs: Sequence[_Run]) -> int:
    return sum(run.lost for run in runs)


def _rounds(peers: Sequence[Forwarder]) -> _Runs:
    """Run all in turns, several rounds."""
    runs: _Runs = defaultdict(list)
    for _ in range(_ROUNDS):
        for peer in peers:
            with ExitStack() as stack:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
                line = stack.enter_context(closing(Line()))
                pid = stack.enter_context(peer.start(folder, line))
                line.warm_up()
                for name, rate in _RATES.items():
                    runs[peer.name, name].append(_run(line, pid, rate))
    return runs


def _run(line: Line, pid: int, rate: float | None) -> _Run:
    line.pass_on(rate, _SETTLING_S)
    before = cpu_s(pid)
    passage = line.pass_on(rate, _WATCHED_S)
    spent_s = cpu_s(pid) - before
    p99_s = statistics.quantiles(passage.latencies_s, n=100)[98]
    return _Run(spent_s / passage.sent * 1e6, p99_s * 1000, passage.lost)
