# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers of both zenoh benchmarks: a router in its own process, a client, a process's CPU clock."""

import json
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh

from benchmarks.processes import ROOT, running, wait_for
from service.zenoh_link.keys import VERSION

#: The suffix of all of a vehicle's telemetry keys.
ALL_TELEMETRY = f"v{VERSION}/telemetry/*"


@contextmanager
def router_program(folder: Path) -> Iterator[tuple[str, int]]:
    """Run a router; yields its endpoint and its process id."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    log = folder / "router.log"
    with running([sys.executable, str(ROOT / "examples" / "zenoh_router.py"), endpoint], log) as process:
        wait_for(lambda: b"is up" in log.read_bytes(), "the router is up")
        yield endpoint, process.pid


def client(endpoint: str) -> zenoh.Session:
    """Open a session like a user's own subscriber."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    return zenoh.open(config)


def configuration(folder: Path, vehicle: str, endpoint: str) -> Path:
    """Write a daemon's configuration file with zenoh and its commands enabled."""
    path = folder / "config.toml"
    path.write_text(
        f'[zenoh]\nvehicle = "{vehicle}"\nconnect = ["{endpoint}"]\n'
        'commands = true\ncommands_without_authentication = "I know"\n'
    )
    return path


def cpu_s(pid: int) -> float:
    """The CPU time of a process, seconds, by its own clock: far finer than the ticks in /proc.

    The clock id is computed like clock_getcpuclockid(3) on Linux.
    """
    return time.clock_gettime(~pid << 3 | 2)
