# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet list` of a thousand light vehicles behind a real router; ten thousand are a benchmark."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import light_vehicles
from tests.support.programs import REPOSITORY, run_naze_bridge, until
from tests.support.zenoh_router import Router, running_router

_COUNT, _SILENT = 1000, 30


@pytest.fixture(scope="module")
def router(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Router]:
    with running_router(tmp_path_factory.mktemp("router")) as router:
        yield router


@pytest.fixture
def vehicles(router: Router, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """The last ones are alive but never heard."""
    command = [sys.executable, "-m", light_vehicles.__name__, router.endpoint, str(_COUNT), "10", str(_SILENT)]
    with (tmp_path / "vehicles.log").open("wb") as log:
        process = subprocess.Popen(command, cwd=REPOSITORY, stdout=log, stderr=log)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_thousand_vehicles_are_listed(router: Router, vehicles: subprocess.Popen[bytes]) -> None:
    def found() -> dict[str, Any]:
        listed = run_naze_bridge("fleet", "list", "--json", "--connect", router.endpoint)
        return json.loads(listed.stdout) if listed.stdout else {}

    def complete() -> dict[str, Any] | None:
        """None while more are silent, as on a busy machine."""
        fleet = found()
        return fleet if (fleet.get("alive"), fleet.get("unanswered")) == (_COUNT, _SILENT) else None

    def printed() -> subprocess.CompletedProcess[str] | None:
        listed = run_naze_bridge("fleet", "list", "--connect", router.endpoint)
        is_complete = "30 of 1,000 vehicles are alive, but did not answer: light-970, " in listed.stderr
        return listed if is_complete else None

    vehicles_found = until(complete, "all vehicles")["vehicles"]
    assert sum(vehicle["answers"] for vehicle in vehicles_found) == _COUNT - _SILENT
    assert sum(vehicle["armed"] is True for vehicle in vehicles_found) == 20
    first = until(printed, "all vehicles as text")
    assert (first.returncode, len(first.stdout.splitlines())) == (1, 1 + _COUNT)
    vehicles.send_signal(signal.SIGKILL)
    until(lambda: found().get("alive") == 0, "the end of all")
