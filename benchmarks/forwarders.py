# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that forward MAVLink from a terminal to UDP: ours, the floor, and mavlink-router."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.line import Line
from benchmarks.processes import ROOT, BenchmarkError, daemon, running

OURS, FLOOR, MAVLINK_ROUTER = "naze-bridge", "C floor", "mavlink-router"
_OTHERS = {FLOOR, MAVLINK_ROUTER}
_SPEED = 57600
#: Starts a forwarder in a folder, on a line; yields its process id.
_Start = Callable[[Path, Line], AbstractContextManager[int]]


@dataclass(frozen=True, slots=True)
class Forwarder:
    """`start` runs it in its own folder, on a line; yields its process id."""

    name: str
    start: _Start


def usable_forwarders() -> list[Forwarder]:
    """Ours, and the others that work on this machine; prints which do not, and why."""
    installed = {each.name: each for each in _installed()}
    for name in sorted(_OTHERS - installed.keys()):
        print(f"  without {name}: not installed")
    for name in sorted(installed.keys() & _OTHERS):
        try:
            with (
                tempfile.TemporaryDirectory() as folder,
                closing(Line()) as line,
                installed[name].start(Path(folder), line),
            ):
                line.warm_up()
        except (BenchmarkError, OSError, subprocess.CalledProcessError) as error:
            print(f"  without {name}: {error}")
            del installed[name]
    return [*installed.values()]


def _installed() -> list[Forwarder]:
    """The floor needs cc; mavlink-router is found as $MAVLINK_ROUTERD, or on the path."""
    found = [Forwarder(OURS, _naze_bridge)]
    if shutil.which("cc"):
        found.insert(0, Forwarder(FLOOR, _floor))
    if router := os.environ.get("MAVLINK_ROUTERD") or shutil.which("mavlink-routerd"):
        found.append(Forwarder(MAVLINK_ROUTER, lambda folder, line: _mavlink_router(router, folder, line)))
    return found


@contextmanager
def _floor(folder: Path, line: Line) -> Iterator[int]:
    program = folder / "forward_floor"
    source = ROOT / "benchmarks" / "forward_floor.c"
    subprocess.run(["cc", "-std=c99", "-O2", "-o", program, source], check=True)  # noqa: S607
    with running([str(program), line.tty, str(line.port)], folder / "floor.log") as process:
        yield process.pid


@contextmanager
def _naze_bridge(folder: Path, line: Line) -> Iterator[int]:
    with daemon(folder, Path(f"{line.tty},{_SPEED}"), f"udpout:127.0.0.1:{line.port}") as process:
        yield process.pid


@contextmanager
def _mavlink_router(program: str, folder: Path, line: Line) -> Iterator[int]:
    """The daemon without its TCP server, and regardless of the machine's configuration."""
    configuration = folder / "mavlink-router.conf"
    configuration.write_text("[General]\nTcpServerPort = 0\n")
    options = ["--conf-file", str(configuration), "--conf-dir", str(folder / "none")]
    command = [program, *options, "--endpoint", f"127.0.0.1:{line.port}", f"{line.tty}:{_SPEED}"]
    with running(command, folder / "mavlink-router.log") as process:
        yield process.pid
