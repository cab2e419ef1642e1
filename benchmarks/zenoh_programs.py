# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers of the zenoh benchmarks."""

from pathlib import Path

from payloads.keys import VERSION

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
