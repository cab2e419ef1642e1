# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers of the zenoh benchmarks: a daemon's configuration, a process's CPU clock."""

import time
from pathlib import Path

from service.zenoh_link.keys import VERSION

#: The suffix of all of a vehicle's telemetry keys.
ALL_TELEMETRY = f"v{VERSION}/telemetry/*"


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
