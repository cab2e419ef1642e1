# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge` as a process forked from one that has imported it, because imports dominate short commands.

It has its own pid, exit status, environment and output. Tests that need a fresh interpreter (memory, loaded modules)
use `programs.NAZE_BRIDGE`.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

#: A module that does not exist is ignored.
PRELOADED = (
    "service.cli.check",
    "service.cli.daemon_client",
    "service.cli.demo",
    "service.cli.direct_bridge",
    "service.cli.doctor.command",
    "service.cli.doctor.examination",
    "service.cli.fleet_command",
    "service.cli.mission_commands",
    "terminal.mission_table",
    "service.cli.serve",
    "service.cli.setup.command",
    "service.cli.status",
    "service.cli.stored_missions",
    "service.web.server",
    "service.zenoh_link.node",
    "rich.console",
    "rich.progress",
    "simulator.commands.sim",
    "tests.support.forked",
    "uvicorn",
)

#: An environment variable: the name of a file with the seconds by which the process's wall clock is wrong.
CLOCK_FILE = "TEST_CLOCK_FILE"

_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(list(PRELOADED))


class Forked:
    """A running `naze-bridge`, with the methods of subprocess.Popen. Its output is appended to files."""

    def __init__(self, arguments: Sequence[str], directory: Path, output: Path, error: Path) -> None:
        self._arguments = arguments
        what = (arguments, directory, dict(os.environ), output, error)
        self._process = _context.Process(target=_run, args=what, daemon=True)
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        code = self.poll()
        if code is None:
            raise subprocess.TimeoutExpired(list(self._arguments), timeout or 0)
        return code

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


def _run(arguments: Sequence[str], directory: Path, environment: dict[str, str], output: Path, error: Path) -> None:
    from service.cli.main import main

    os.environ.clear()
    os.environ.update(environment)
    if CLOCK_FILE in environment:
        _follow_clock(Path(environment[CLOCK_FILE]))
    os.chdir(directory)
    for stream, path, mode in ((0, os.devnull, os.O_RDONLY), (1, output, os.O_WRONLY), (2, error, os.O_WRONLY)):
        descriptor = os.open(path, mode | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(descriptor, stream)
        os.close(descriptor)
    sys.stdin, sys.stdout = open(0), open(1, "w")  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, errors="backslashreplace")  # noqa: SIM115
    main(list(arguments), prog_name="naze-bridge")


def _follow_clock(file: Path) -> None:
    """The monotonic clock goes on, as it does when a Pi's clock is set."""
    true_time = time.time
    time.time = lambda: true_time() + float(file.read_text())
