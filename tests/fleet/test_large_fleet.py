# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet list` and `fleet watch` of a thousand light vehicles behind a real router; ten thousand are a benchmark."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from fleet.watch import Watch, watching
from fleet.watch_screen import ScreenRow, screen
from tests.support import light_vehicles
from tests.support.programs import REPOSITORY, run_naze_bridge, until
from tests.support.zenoh_router import Router, client, running_router

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


def test_a_thousand_vehicles_in_list_and_watch(router: Router, vehicles: subprocess.Popen[bytes]) -> None:
    with ExitStack() as stack:
        session, roll = stack.enter_context(client(router.endpoint)), stack.enter_context(client(router.endpoint))
        watch = stack.enter_context(watching(session, roll, "fleet"))
        heard = _COUNT - _SILENT
        until(lambda: _head(watch) == f"Heard {heard} of 1,000 vehicles, 20 armed, 0 with problems", "all vehicles")

        listed = run_naze_bridge("fleet", "list", "--json", "--connect", router.endpoint)
        found = json.loads(listed.stdout)
        assert (listed.returncode, found["alive"], found["unanswered"]) == (1, _COUNT, _SILENT)
        assert sum(vehicle["answers"] for vehicle in found["vehicles"]) == heard
        assert sum(vehicle["armed"] is True for vehicle in found["vehicles"]) == 20
        armed = run_naze_bridge("fleet", "list", "--where", "armed=true", "--limit", "5", "--connect", router.endpoint)
        assert (armed.returncode, "and 15 more" in armed.stdout) == (1, True)
        assert "30 of 1,000 vehicles are alive, but did not answer: light-970, " in armed.stderr

        vehicles.send_signal(signal.SIGKILL)
        until(lambda: _head(watch) == "No such vehicle is alive. Ctrl-C ends.", "the end of all")


def _head(watch: Watch) -> str:
    rows = [ScreenRow(vehicle, age_s) for vehicle, age_s in watch.look()]
    shown = screen(rows, 0, 19, is_connected=True, is_listed=watch.is_listed)
    return str(getattr(shown, "renderables", [shown])[0])
