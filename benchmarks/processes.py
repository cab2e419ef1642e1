# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured programs, each in its own process, so that only its own CPU and memory count."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.support.programs import NAZE_BRIDGE

ROOT = Path(__file__).resolve().parent.parent
#: The folder of saved figures (git-ignored).
RESULTS = ROOT / "benchmarks" / "results"
#: Compiled bytecode, as for an installed daemon, regardless of the shell's PYTHONDONTWRITEBYTECODE.
ENVIRONMENT = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"} | {
    "PYTHONPYCACHEPREFIX": str(RESULTS / "bytecode")
}
_TIMEOUT_S = 30.0
_POLL_S = 0.002


class BenchmarkError(Exception):
    """A measured program did not behave as the measurement needs."""


@contextmanager
def running(command: Sequence[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program with its output in `log`; end it with SIGTERM, or SIGKILL if it hangs."""
    with log.open("wb") as output:
        process = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, stdout=output, stderr=output)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_for(condition: Callable[[], bool], what: str, timeout_s: float = _TIMEOUT_S) -> None:
    """Wait until `condition` holds; BenchmarkError if it takes too long."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            raise BenchmarkError(f"timed out after {timeout_s:.0f} s, waiting until {what}")
        time.sleep(_POLL_S)


@dataclass(frozen=True, slots=True)
class Board:
    """A simulated Naze on a pseudo-terminal that keeps the pace of a UART."""

    link: Path


@contextmanager
def simulated_naze(folder: Path, *options: str) -> Iterator[Board]:
    """Run `naze-bridge sim` with `options`."""
    board = Board(folder / "naze")
    command = [*NAZE_BRIDGE, "sim", "--link", str(board.link), *options]
    log = folder / "sim.log"
    with running(command, log):
        wait_for(lambda: b"Simulated Naze at" in log.read_bytes(), "the simulated Naze is up")
        yield board


@dataclass(frozen=True, slots=True)
class DaemonProcess:
    """A running `naze-bridge run`."""

    pid: int
    started_at: float  # time.time() just before the process was created
    _log: Path

    def events(self, name: str) -> list[dict[str, Any]]:
        """The logged events of that name, oldest first."""
        lines = self._log.read_bytes().splitlines(keepends=True)
        events = [json.loads(line) for line in lines if line.startswith(b"{") and line.endswith(b"\n")]
        return [event for event in events if event["event"] == name]

    def wait_for_event(self, name: str, count: int = 1) -> dict[str, Any]:
        """Wait until an event was logged `count` times; returns the last of them."""
        wait_for(lambda: len(self.events(name)) >= count, f"the daemon logs {name} (see {self._log})")
        return self.events(name)[count - 1]


@contextmanager
def daemon(folder: Path, fc: Path, gcs: str, *options: str) -> Iterator[DaemonProcess]:
    """Run the daemon with its own mission store."""
    command = [*NAZE_BRIDGE, "run", "--fc", str(fc), "--gcs", gcs, "--state-dir", str(folder / "state"), *options]
    started_at = time.time()
    with running(command, folder / "daemon.log") as process:
        yield DaemonProcess(process.pid, started_at, folder / "daemon.log")


@contextmanager
def floor_program(folder: Path, *arguments: str) -> Iterator[tuple[int, Path]]:
    """Run one of benchmarks.floors; yields its process id and the file with its output."""
    log = folder / "floor.log"
    with running([sys.executable, "-m", "benchmarks.floors", *arguments], log) as process:
        yield process.pid, log


def cpu_s(pid: int) -> float:
    """The CPU time of a process, seconds, by its own clock: far finer than the ticks in /proc.

    The clock id is computed like clock_getcpuclockid(3) on Linux.
    """
    return time.clock_gettime(~pid << 3 | 2)
