# SPDX-License-Identifier: GPL-3.0-or-later
"""Notifications to systemd, and stopping during a mission transfer."""

import asyncio
import json
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import pytest

from protocols.mission_item import MissionResult
from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.machine.notify import Notifier
from service.settings import Settings
from service.settings.addresses import parse_fc, parse_gcs
from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.plan import as_items, judge, plain_plan, records_of
from tests.support.programs import TIMEOUT_S, free_port, run_naze_bridge, until, until_async
from tests.support.programs import Daemon as DaemonProgram

_LONG = plain_plan(146)


class BugError(Exception):
    """A bug in the bridge itself."""


class Systemd:
    """The service manager's end of sd_notify(3)."""

    def __init__(self, directory: Path) -> None:
        self.path = directory / "notify"
        self.received: list[str] = []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(str(self.path))

    def listen(self) -> list[str]:
        """All notifications so far."""
        while True:
            try:
                self.received.append(self._socket.recv(4096).decode())
            except BlockingIOError:
                return self.received

    def status(self) -> str:
        texts = [text for text in self.listen() if text.startswith("STATUS=")]
        return texts[-1].removeprefix("STATUS=") if texts else ""

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def systemd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Systemd]:
    """A service manager for the daemons of a test."""
    with closing(Systemd(tmp_path)) as systemd:
        monkeypatch.setenv("NOTIFY_SOCKET", str(systemd.path))
        monkeypatch.setenv("WATCHDOG_USEC", "600000")
        yield systemd


def test_the_daemon_is_ready_without_a_flight_controller(start: Starter, systemd: Systemd) -> None:
    daemon = start.daemon(str(start.directory / "naze"))
    until(lambda: "READY=1" in systemd.listen(), "READY")
    until(lambda: "is missing: plug the flight controller in" in systemd.status(), "the port in the status")
    assert systemd.status().endswith("; 0 ground stations")
    start.board()
    daemon.wait()
    until(lambda: "(MSP, 115200 baud, disarmed); 0 ground stations" in systemd.status(), "the link in the status")
    with udp_station(daemon.address) as station:
        station.send_heartbeat()
        until(lambda: systemd.status().endswith("; 1 ground station"), "the ground station in the status")
    assert daemon.end() == 0
    assert systemd.listen().count("READY=1") == systemd.listen().count("STOPPING=1") == 1


async def next_feed(systemd: Systemd, before: int) -> int:
    """Wait until the watchdog is fed again; return the total count."""
    await until_async(lambda: systemd.listen().count("WATCHDOG=1") > before, "a watchdog message")
    return systemd.listen().count("WATCHDOG=1")


async def test_the_watchdog_is_fed_by_the_event_loop(systemd: Systemd, tmp_path: Path) -> None:
    """A hung loop stops feeding it even if other threads run."""
    daemon = Daemon(Settings(parse_fc("sim:"), [parse_gcs(f"udpin:127.0.0.1:{free_port()}")], tmp_path / "state"))
    running = asyncio.create_task(run_until_signal(daemon, Notifier(), lambda: daemon.settings))
    fed = await next_feed(systemd, 2)
    time.sleep(1.0)  # noqa: ASYNC251 - this is the hang; the watchdog would have waited for 0.6 s
    assert systemd.listen().count("WATCHDOG=1") == fed
    await next_feed(systemd, fed)
    running.cancel()
    await asyncio.wait([running])


async def test_a_bridge_that_no_longer_ticks_does_not_feed_the_watchdog(
    systemd: Systemd, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a flight controller, no input wakes it again."""
    daemon = Daemon(Settings(parse_fc(str(tmp_path / "naze")), [], tmp_path / "state"))
    running = asyncio.create_task(run_until_signal(daemon, Notifier(), lambda: daemon.settings))
    await next_feed(systemd, 0)

    def bug() -> float:
        raise BugError

    monkeypatch.setattr(daemon.bridge, "next_deadline", bug)
    await until_async(lambda: not daemon.is_ticking, "the end of the ticks")
    fed = systemd.listen().count("WATCHDOG=1")
    await asyncio.sleep(1.0)
    assert systemd.listen().count("WATCHDOG=1") == fed
    running.cancel()
    await asyncio.wait([running])


async def test_a_bug_does_not_prevent_a_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    daemon = Daemon(Settings(parse_fc("sim:"), [], tmp_path / "state"))
    running = asyncio.create_task(run_until_signal(daemon, Notifier({}), lambda: daemon.settings))
    await daemon.started.wait()

    def bug(_now: float) -> None:
        raise BugError

    monkeypatch.setattr(daemon.bridge, "stop_missions", bug)
    signal.raise_signal(signal.SIGTERM)
    async with asyncio.timeout(TIMEOUT_S):
        await asyncio.wait([running])
    assert running.exception() is None


def test_a_failed_start_is_never_ready(start: Starter, systemd: Systemd) -> None:
    first = start.daemon("sim:")
    until(lambda: "READY=1" in systemd.listen(), "READY")
    systemd.received.clear()
    link = f"udpin:127.0.0.1:{first.port}"
    ended = run_naze_bridge("run", "--fc", "sim:", "--gcs", link, "--state-dir", start.directory / "other")
    assert ended.returncode == 1
    assert "READY=1" not in systemd.listen()


def test_a_service_manager_in_the_abstract_namespace_is_notified(tmp_path: Path) -> None:
    """systemd gives its name with a leading @."""
    name = f"naze-bridge-test-{tmp_path}"
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as systemd:
        systemd.bind(f"\0{name}")
        systemd.settimeout(TIMEOUT_S)
        notifier = Notifier({"NOTIFY_SOCKET": f"@{name}"})
        assert notifier.watchdog_s is None
        notifier.reloading()
        kind, moment = systemd.recv(100).decode().splitlines()
        assert kind == "RELOADING=1"
        assert int(moment.removeprefix("MONOTONIC_USEC=")) <= time.monotonic_ns() // 1000
        notifier.close()


@pytest.mark.parametrize("environment", [{"WATCHDOG_PID": "1"}, {"WATCHDOG_USEC": "soon"}, {}])
def test_a_watchdog_for_another_process_is_ignored(environment: dict[str, str]) -> None:
    assert Notifier({"WATCHDOG_USEC": "1000000", **environment}).watchdog_s == (None if environment else 1.0)


def test_a_missing_service_manager_is_ignored(start: Starter, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", str(start.directory / "nobody"))
    daemon = start.daemon("sim:")
    daemon.wait()
    assert daemon.end() == 0
    assert "Traceback" not in daemon.printed


def push_begun(daemon: DaemonProgram) -> socket.socket:
    """Push a long list like the command line; return the connection once the board has part of it."""
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(TIMEOUT_S)
    connection.connect(str(daemon.state_dir / "control.sock"))
    items = [asdict(item) for item in as_items(_LONG)]
    connection.sendall(json.dumps({"do": "push", "source": "test", "items": items}).encode() + b"\n")
    while b"progress" not in connection.recv(4096):
        pass
    return connection


def last_answer(connection: socket.socket) -> dict[str, dict[str, object]]:
    with connection, connection.makefile() as lines:
        answer: dict[str, dict[str, object]] = json.loads(list(lines)[-1])
        return answer


def outcomes(start: Starter, daemon: DaemonProgram) -> list[str]:
    """The stored outcomes, read by another daemon on the same store."""
    after = start.daemon("sim:", state_dir=daemon.state_dir)
    after.wait_up()
    return [mission["outcome"] for mission in after.missions()]


def test_a_push_close_to_its_end_is_finished(start: Starter) -> None:
    bench = start.bench()
    connection = push_begun(bench.daemon)
    assert bench.daemon.end() == 0
    assert last_answer(connection)["result"]["ack"] == "MAV_MISSION_ACCEPTED"
    assert bench.board.records() == records_of(judge(_LONG))
    assert outcomes(start, bench.daemon) == ["VERIFIED"]


@pytest.mark.parametrize("trouble", ["slow", "deaf"])
def test_a_push_that_would_take_long_is_aborted(start: Starter, trouble: str) -> None:
    """The old list is kept, the sender is told, the outcome is stored, and systemd waits at most 2 s."""
    bench = start.bench("--baud", "9600") if trouble == "slow" else start.bench()
    bench.daemon.push(plain_plan(5))
    old = bench.board.records()
    connection = push_begun(bench.daemon)
    if trouble == "deaf":
        bench.board.set("hang 10")
    # Neither push can finish within 2 s, so the result shows that the daemon did not wait.
    assert bench.daemon.end() == 0
    answer = last_answer(connection)["result"]
    assert answer["ack"] == "MAV_MISSION_DENIED"
    assert "old mission is kept" in str(answer["text"]) or trouble == "deaf"
    assert outcomes(start, bench.daemon) == ["FAILED", "VERIFIED"]
    if trouble == "slow":
        assert bench.board.records() == old
    assert "Traceback" not in bench.daemon.printed


def test_a_second_signal_does_not_wait(start: Starter) -> None:
    bench = start.bench()
    connection = push_begun(bench.daemon)
    bench.board.set("hang 10")
    bench.daemon.process.send_signal(signal.SIGINT)
    until(lambda: bench.daemon.has_logged("daemon.stopping"), "the first signal")
    assert bench.daemon.end(signal.SIGINT) == 0
    connection.close()
    assert "Traceback" not in bench.daemon.printed


def test_a_ground_station_is_told_of_the_stop(start: Starter) -> None:
    """Its upload is refused with the reason."""
    bench = start.bench()
    with udp_station(bench.daemon.address) as station:
        station.send_heartbeat()
        station.send_count(20)
        station.wait_for("MISSION_REQUEST")
        bench.daemon.process.send_signal(signal.SIGTERM)
        assert station.wait_for("MISSION_ACK").type == MissionResult.OPERATION_CANCELLED
        assert "Upload ended: naze-bridge stops" in " ".join(
            message.text for message in station.received if message.get_type() == "STATUSTEXT"
        )
