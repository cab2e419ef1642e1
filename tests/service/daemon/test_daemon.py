# SPDX-License-Identifier: GPL-3.0-or-later

import asyncio
import os
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from bridge.model.vehicle import Source
from service.daemon.client import ControlError, ask_daemon
from service.daemon.daemon import Daemon
from service.machine.host import Host
from service.settings import Settings
from service.settings.addresses import SimulatedFc
from tests.support.benches import Starter
from tests.support.inside import inside
from tests.support.programs import NAZE_BRIDGE, REPOSITORY, TIMEOUT_S, free_port, until

LOSSES = {"fc.lost", "fc.port_lost"}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_start_search_and_stop_are_logged(start: Starter, number: signal.Signals) -> None:
    bench = start.bench()
    assert bench.daemon.end(number) == 0
    events = bench.daemon.events()
    assert [event["event"] for event in events if event["event"] in ("daemon.started", "fc.searching")] == [
        "daemon.started",
        "fc.searching",
    ]
    started, stopping = events[0], bench.daemon.has_logged("daemon.stopping")
    assert started["fc"] == str(bench.board.link)
    assert started["gcs"] == [f"udpin:127.0.0.1:{bench.daemon.port}"]
    assert started["version"]
    assert stopping is not None
    assert stopping["signal"] == number.name
    # Stopping is not reported as a loss.
    assert not [event for event in events if event["event"] in LOSSES]


def test_an_unread_log_does_not_stop_the_daemon(tmp_path: Path) -> None:
    """As with `naze-bridge run 2>&1 | less`, or a stalled journal: the pipe is full before the first line."""
    unread, full = os.pipe()
    os.set_blocking(full, False)
    with suppress(BlockingIOError):
        while True:
            os.write(full, bytes(4096))
    os.set_blocking(full, True)
    options = ("run", "--fc", "sim:", "--gcs", f"udpin:127.0.0.1:{free_port()}", "--state-dir", str(tmp_path))
    with subprocess.Popen([*NAZE_BRIDGE, *options], cwd=REPOSITORY, stderr=full) as daemon:

        def has_found() -> bool:
            with suppress(ControlError):
                return bool(ask_daemon(tmp_path, {"do": "status"})["flight_controller"])
            return False

        try:
            until(has_found, "the flight controller")
        finally:
            daemon.kill()
    os.close(full)
    os.close(unread)


async def test_a_wrong_clock_is_reported_until_a_network_sets_it(tmp_path: Path) -> None:
    daemon = Daemon(Settings(SimulatedFc()), Host(tmp_path))
    now, vehicle = daemon.started_at, daemon.bridge.vehicle
    clock = time.time() - asyncio.get_running_loop().time() + now  # the machine's at that moment
    assert daemon.clock_trouble == ""
    vehicle.hear_station_time(clock + 30, now)
    assert daemon.clock_trouble == ""
    vehicle.hear_station_time(clock + 86_400, now)
    remedy = "sudo date --set '+86400 seconds'"
    assert daemon.clock_trouble == f"the Pi's clock is 1 day, 0:00:00 behind a ground station: {remedy}"
    vehicle.hear_gps_time(now, Source.MSP, clock - 7200)
    assert "2:00:00 ahead of the flight controller" in daemon.clock_trouble
    (tmp_path / "run/systemd/timesync").mkdir(parents=True)
    (tmp_path / "run/systemd/timesync/synchronized").touch()
    assert daemon.clock_trouble == ""


async def test_an_exception_in_the_bridge_is_logged_and_the_line_restarted(tmp_path: Path) -> None:
    """Telemetry continues afterwards, and a client that waits for an answer gets the reason."""
    with capture_logs() as events:
        daemon = Daemon(Settings(SimulatedFc(), state_dir=tmp_path))
        running = asyncio.create_task(daemon.run())

        async def found() -> None:
            async with asyncio.timeout(TIMEOUT_S):
                while inside(daemon.bridge).session.state.controller is None:  # noqa: ASYNC110
                    await asyncio.sleep(0.01)

        await found()
        answer: asyncio.Task[None] = asyncio.create_task(daemon.answer(lambda _done, _now: None))
        await asyncio.sleep(0)
        healthy = inside(daemon.bridge).session.tick

        def faulty(_now: float) -> None:
            inside(daemon.bridge).session.tick = healthy  # type: ignore[method-assign]
            raise AttributeError("link")

        inside(daemon.bridge).session.tick = faulty  # type: ignore[assignment,method-assign]
        async with asyncio.timeout(TIMEOUT_S):
            while inside(daemon.bridge).session.state.controller is not None:  # noqa: ASYNC110
                await asyncio.sleep(0)
        await found()
        with pytest.raises(ControlError, match="the daemon failed"):
            await answer
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running
    (fault,) = [event for event in events if event["event"] == "daemon.fault"]
    assert isinstance(fault["exc_info"], AttributeError)
