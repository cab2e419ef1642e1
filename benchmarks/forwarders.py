# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that forward MAVLink from a terminal to UDP: ours, the floor, and other projects'."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.line import Line
from benchmarks.processes import ROOT, BenchmarkError, daemon, running

OURS, FLOOR, MAVPROXY, MAVP2P = "naze-bridge", "C floor", "MAVProxy", "mavp2p"
MAVLINK_ROUTER = "mavlink-router"
_OTHERS = {FLOOR, MAVLINK_ROUTER, MAVP2P, MAVPROXY}
_SPEED = 57600
_MAVPROXY = Path(sys.executable).parent / "mavproxy.py"
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
    """The floor needs cc, MAVProxy comes with `make test`'s dependencies.

    mavlink-router and mavp2p are found as $MAVLINK_ROUTERD and $MAVP2P, or on the path.
    """
    found = [Forwarder(OURS, _naze_bridge)]
    if _MAVPROXY.exists():
        found.append(Forwarder(MAVPROXY, _mavproxy))
    if shutil.which("cc"):
        found.insert(0, Forwarder(FLOOR, _floor))
    if router := os.environ.get("MAVLINK_ROUTERD") or shutil.which("mavlink-routerd"):
        found.append(Forwarder(MAVLINK_ROUTER, lambda folder, line: _mavlink_router(router, folder, line)))
    if mavp2p := os.environ.get("MAVP2P") or shutil.which("mavp2p"):
        found.append(Forwarder(MAVP2P, lambda folder, line: _mavp2p(mavp2p, folder, line)))
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
def _mavproxy(folder: Path, line: Line) -> Iterator[int]:
    """The daemon with its default modules."""
    program = [sys.executable, str(_MAVPROXY), "--daemon"]
    link = [f"--master={line.tty}", f"--baudrate={_SPEED}", f"--out=127.0.0.1:{line.port}", "--mav20"]
    with running([*program, *link, f"--state-basedir={folder}"], folder / "mavproxy.log") as process:
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


@contextmanager
def _mavp2p(program: str, folder: Path, line: Line) -> Iterator[int]:
    command = [program, f"serial:{line.tty}:{_SPEED}", f"udpc:127.0.0.1:{line.port}"]
    with running(command, folder / "mavp2p.log") as process:
        yield process.pid
