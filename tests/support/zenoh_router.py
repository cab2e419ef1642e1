# SPDX-License-Identifier: GPL-3.0-or-later
"""The router of a fleet as a separate process: zenohd if ZENOHD names one, else examples/zenoh_router.py."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh

from tests.support.programs import TIMEOUT_S, Program, free_port, until

ZENOHD = os.environ.get("ZENOHD")
_UP = "is up" if ZENOHD is None else "can be reached at"
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


class Router(Program):
    """A router on `endpoint`. `config`: a zenoh configuration with the same endpoint."""

    def __init__(self, directory: Path, endpoint: str = "", config: Path | None = None) -> None:
        self.endpoint = endpoint or f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        super().__init__(directory / "router.log", str(config or self.endpoint))

    def _start(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, str(EXAMPLES / "zenoh_router.py"), *self._arguments]
        if ZENOHD is not None:
            (where,) = self._arguments
            command = [ZENOHD, "--no-multicast-scouting", "-c" if where.endswith(".json5") else "-l", where]
        with self._output.open("ab") as file:
            self._starts = self._output.read_text().count(_UP)
            where = self._arguments[0]
            folder = Path(where).parent if where.endswith(".json5") else None
            return subprocess.Popen(command, stdout=file, stderr=file, cwd=folder)

    def wait(self) -> None:
        until(lambda: self.printed.count(_UP) > self._starts or not self.is_alive, "the router")
        assert self.is_alive, self.printed

    def stop(self) -> None:
        """End the router, after SIGCONT in case it is stopped."""
        if self.is_alive:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
            self.process.wait(TIMEOUT_S)

    def start_again(self) -> None:
        self.process = self._start()
        self.wait()


@contextmanager
def running_router(directory: Path, endpoint: str = "", config: Path | None = None) -> Iterator[Router]:
    router = Router(directory, endpoint, config)
    try:
        router.wait()
        yield router
    finally:
        router.end(signal.SIGKILL)


def client(endpoint: str) -> zenoh.Session:
    """Open a session like a user's own subscriber."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    return zenoh.open(config)
