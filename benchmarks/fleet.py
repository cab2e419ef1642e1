# SPDX-License-Identifier: GPL-3.0-or-later
"""A fleet of 5 and of 50 through one router: `fleet list`, `fleet push` to all, and the cost of each further vehicle.

Each vehicle is a daemon (`naze-bridge run`) in its own process, with the simulated Naze inside, which keeps the pace of
a UART. The router is another process: $ZENOHD, or the router of the Python package. Whole commands are timed, from
start to exit; the floor is a Python program that only opens and closes a zenoh session.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.missions import COUNT, random_mission
from benchmarks.processes import ENVIRONMENT, ROOT, cpu_s, daemon, wait_for
from benchmarks.zenoh_programs import ALL_TELEMETRY, configuration
from payloads.keys import STATE, full
from payloads.names import DEFAULT_PREFIX
from protocols.mission_file import write_qgc_wpl
from tests.support.programs import NAZE_BRIDGE, free_port
from tests.support.zenoh_router import client, running_router

_FEW, _MANY = 5, 50
_STATES = full(DEFAULT_PREFIX, "*", STATE.suffix)
_TELEMETRY = full(DEFAULT_PREFIX, "*", ALL_TELEMETRY)
_LISTS = 7
_WATCHED_S = 10.0
_OPEN = "import json, sys, zenoh; c = zenoh.Config(); c.insert_json5('mode', json.dumps('client'))"
_OPEN_AND_LEAVE = f"{_OPEN}; c.insert_json5('connect/endpoints', json.dumps([sys.argv[1]])); zenoh.open(c).close()"


@dataclass(frozen=True, slots=True)
class _Cost:
    """The cost of a fleet. Times in seconds; CPU in percent of one core: the router's, and all vehicles' together."""

    list_s: float
    push_s: float
    failed: int
    router_percent: float
    vehicles_percent: float


def measure() -> list[Figure]:
    """Measure both fleets; the larger one contains the smaller one."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        router = stack.enter_context(running_router(folder))
        endpoint = router.endpoint
        start_s = statistics.median(_timed([sys.executable, "-c", _OPEN_AND_LEAVE, endpoint]) for _ in range(_LISTS))
        pids: list[int] = []
        costs = {}
        for count in (_FEW, _MANY):
            while len(pids) < count:  # a few at a time: a start costs a third of a second of a core
                new = range(len(pids), len(pids) + _FEW)
                pids += [stack.enter_context(_vehicle(folder, number, endpoint)) for number in new]
                _wait_for_vehicles(endpoint, len(pids))
            costs[count] = _cost(folder, count, endpoint, router.process.pid, pids)
    few, many = costs[_FEW], costs[_MANY]
    floor = Floor(start_s, "Python, a zenoh session")
    return [
        Figure(f"fleet list of {_FEW}, median of {_LISTS}", few.list_s, "s", floor),
        Figure(f"fleet list of {_MANY}, median of {_LISTS}", many.list_s, "s", floor, 1.0),
        Figure(f"fleet push of {COUNT} items to {_FEW}", few.push_s, "s"),
        Figure(f"fleet push of {COUNT} items to {_MANY}", many.push_s, "s", Floor(few.push_s, f"the push to {_FEW}")),
        Figure(f"vehicles of {_FEW + _MANY} that a push failed for", few.failed + many.failed, "", None, 0),
        _each("router, all telemetry read: CPU a vehicle", few.router_percent, many.router_percent),
        _each("daemon, all telemetry read: CPU a vehicle", few.vehicles_percent, many.vehicles_percent),
    ]


def _each(name: str, few: float, many: float) -> Figure:
    """Make a figure of the cost per vehicle of the larger fleet, as a multiple of that of the smaller one."""
    floor = Floor(few / _FEW, f"the same among {_FEW}")
    return Figure(f"{name} among {_MANY}", many / _MANY, "% of a core", floor, 1.5, times_floor=True)


def _cost(folder: Path, count: int, endpoint: str, router: int, vehicles: Sequence[int]) -> _Cost:
    list_s = statistics.median(_timed(_fleet("list", endpoint)) for _ in range(_LISTS))
    mission = folder / "mission.waypoints"
    mission.write_text(write_qgc_wpl(random_mission(count)))
    began_at = time.perf_counter()
    pushed = subprocess.run(
        _fleet("push", endpoint, str(mission), "--all"), cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=False
    )
    push_s = time.perf_counter() - began_at
    answers = json.loads(pushed.stdout)["vehicles"]
    failed = count - sum(answer["ok"] for answer in answers)
    with client(endpoint) as session, session.declare_subscriber(_TELEMETRY, lambda _: None):
        time.sleep(1.0)
        before = cpu_s(router), sum(map(cpu_s, vehicles))
        time.sleep(_WATCHED_S)
        after = cpu_s(router), sum(map(cpu_s, vehicles))
    router_percent, vehicles_percent = (100 * (b - a) / _WATCHED_S for a, b in zip(before, after, strict=True))
    return _Cost(list_s, push_s, failed, router_percent, vehicles_percent)


def _fleet(command: str, endpoint: str, *arguments: str) -> list[str]:
    return [*NAZE_BRIDGE, "fleet", command, *arguments, "--connect", endpoint, "--json"]


def _timed(command: Sequence[str]) -> float:
    began_at = time.perf_counter()
    subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True)
    return time.perf_counter() - began_at


def _wait_for_vehicles(endpoint: str, count: int) -> None:
    def are_there() -> bool:
        time.sleep(0.2)
        states = [json.loads(reply.ok.payload.to_bytes()) for reply in session.get(_STATES) if reply.ok]
        return sum(state["mission"] is not None for state in states) == count

    with client(endpoint) as session:
        wait_for(are_there, f"{count} vehicles know what their flight controllers hold")


@contextmanager
def _vehicle(folder: Path, number: int, endpoint: str) -> Iterator[int]:
    """Run a daemon on a simulated Naze, with commands enabled; yields its process id."""
    own = folder / f"naze-{number}"
    own.mkdir()
    config = configuration(own, f"naze-{number}", endpoint)
    gcs = f"udpin:127.0.0.1:{free_port()}"
    with daemon(own, Path("sim:"), gcs, "--config", str(config)) as process:
        yield process.pid
