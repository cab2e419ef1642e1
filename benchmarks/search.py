# SPDX-License-Identifier: GPL-3.0-or-later
"""The times to find a flight controller and to find it again, and wrong verdicts on noise.

Daemon and simulated Naze run in separate processes. The daemon is running without a port when the clock starts: the
port appears with a flight controller on it, and the clock stops with a line of the daemon's log, so the figures include
the time to notice the port. "Sensed" (fc.sensed): protocol and speed are known. "Identified" (fc.found): the board has
also identified itself, everything twice, which takes three seconds of line time at 1200 baud.

Noise needs no port: the search gets it directly, in simulated time, at the rate of a full line.
"""

import random
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.processes import BenchmarkError, Board, DaemonProcess, daemon, logged_at, simulated_naze
from bridge.fc.profile import Autopilot
from bridge.fc.states.base import Port, PortOpened
from bridge.fc.states.searching import SPEEDS, Searching
from bridge.line.runner import Runner
from simulator.board.options import SimOptions
from tests.support.programs import free_port

_RUNS = 5
_RETURNS = 8
_SEED = 1
_BITS_PER_BYTE = 10
_READ_BYTES = 256
_NOISE_BYTES = 64_000_000


def measure() -> list[Figure]:
    """Measure finding at every speed, finding again, and noise."""
    first, *others = dict.fromkeys(SPEEDS)
    return [*_first_speed(first), *_other_speeds(others), *_returns(first), _noise()]


@dataclass(frozen=True, slots=True)
class _Found:
    """Seconds from the appearance of the port."""

    sensed: float
    identified: float


def _first_speed(baud: int) -> list[Figure]:
    found = [_find(baud) for _ in range(_RUNS)]
    return [
        Figure(f"sensed at {baud} baud, worst of {_RUNS}", max(each.sensed for each in found), "s", None, 1.5),
        Figure(f"identified at {baud} baud, worst of {_RUNS}", max(each.identified for each in found), "s"),
    ]


def _other_speeds(speeds: Sequence[int]) -> list[Figure]:
    found = {baud: _find(baud) for baud in speeds}
    slowest = min(speeds)
    return [
        *(Figure(f"sensed at {baud} baud", each.sensed, "s", None, 8.0) for baud, each in found.items()),
        Figure(f"identified at {slowest} baud", found[slowest].identified, "s"),
    ]


def _find(baud: int) -> _Found:
    with tempfile.TemporaryDirectory() as name, _waiting_daemon(Path(name), baud) as (board, process):
        return _plug(board, process, baud)


def _returns(baud: int) -> list[Figure]:
    chance = random.Random(_SEED)
    with tempfile.TemporaryDirectory() as name, _waiting_daemon(Path(name), baud) as (board, process):
        _plug(board, process, baud)

        def lose_and_return(lost: Sequence[str], returned: Sequence[str]) -> float:
            time.sleep(chance.uniform(0, 1))
            board.tell("unplug", *lost)
            time.sleep(chance.uniform(0.1, 2))
            return _plug(board, process, baud, *returned).identified

        replugs = [lose_and_return((), ()) for _ in range(_RETURNS)]
        power_cycles = [lose_and_return(("power off",), ("power on",)) for _ in range(_RETURNS)]
    return [
        Figure(f"identified again after the port's return, worst of {_RETURNS}", max(replugs), "s", None, 3.0),
        Figure(
            f"the same after a power cycle, worst of {_RETURNS}",
            max(power_cycles),
            "s",
            Floor(SimOptions().boot_ms / 1000, "the board's boot"),
            1.1,
            times_floor=True,
        ),
    ]


@contextmanager
def _waiting_daemon(folder: Path, baud: int) -> Iterator[tuple[Board, DaemonProcess]]:
    """Run a daemon whose port is still missing."""
    with simulated_naze(folder, "--baud", str(baud)) as board:
        board.tell("unplug")
        with daemon(folder, board.link, f"udpin:127.0.0.1:{free_port()}", "--verbose") as process:
            process.wait_for_event("fc.port_unavailable")
            yield board, process


def _plug(board: Board, process: DaemonProcess, baud: int, *before: str) -> _Found:
    """Create the port; returns the time that the daemon took. BenchmarkError if it found something else."""
    known = len(process.events("fc.found"))
    plugged_at = time.time()
    board.tell(*before, "plug")
    found = process.wait_for_event("fc.found", known + 1)
    if (found["protocol"], found["speed_baud"]) != ("MSP", baud):
        raise BenchmarkError(f"at {baud} baud the daemon found {found}")
    sensed_at = logged_at(process.events("fc.sensed")[-1])
    return _Found(sensed_at - plugged_at, logged_at(found) - plugged_at)


def _noise() -> Figure:
    """Feed random bytes, with a new search after each verdict; every verdict is a wrong one."""
    chance = random.Random(_SEED)
    wrong = fed = 0
    now = 0.0
    port = Port(SPEEDS, Autopilot.AUTO, (), Runner(), lambda _frames, _kinds: None)
    search = Searching(port, PortOpened(), now)
    while fed < _NOISE_BYTES:
        assert search.speed is not None
        now += _READ_BYTES * _BITS_PER_BYTE / search.speed
        search.receive(chance.randbytes(_READ_BYTES), now)
        fed += _READ_BYTES
        search.tick(now)
        port.output.clear()
        if search.found:
            wrong += 1
            port.good_speeds.clear()
            search = Searching(port, PortOpened(), now)
    return Figure(f"wrong verdicts on {fed / 1e6:.0f} MB of noise", wrong, "", None, 0)
