# SPDX-License-Identifier: GPL-3.0-or-later
"""Notifications to systemd: ready, watchdog, stopping."""

import asyncio
import socket
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from bridge.bridge import Bridge
from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.machine.notify import Notifier
from service.settings import Settings
from service.settings.addresses import parse_fc, parse_gcs
from tests.e2e.test_service_manager import BugError
from tests.support.benches import Starter
from tests.support.programs import TIMEOUT_S, free_port, run_naze_bridge, until, until_async


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
    assert daemon.end() == 0
    assert systemd.listen().count("READY=1") == systemd.listen().count("STOPPING=1") == 1


async def next_feed(systemd: Systemd, before: int) -> int:
    """Wait until the watchdog is fed again; return the total count."""
    await until_async(lambda: systemd.listen().count("WATCHDOG=1") > before, "a watchdog message")
    return systemd.listen().count("WATCHDOG=1")


async def test_the_watchdog_is_fed_by_the_event_loop(systemd: Systemd, tmp_path: Path) -> None:
    """A hung loop stops feeding it even if other threads run."""
    daemon = Daemon(Settings(parse_fc("sim:"), [parse_gcs(f"udpin:127.0.0.1:{free_port()}")], tmp_path / "state"))
    running = asyncio.create_task(run_until_signal(daemon, Notifier()))
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
    running = asyncio.create_task(run_until_signal(daemon, Notifier()))
    await next_feed(systemd, 0)

    def bug(_bridge: Bridge) -> float:
        raise BugError

    monkeypatch.setattr(Bridge, "due", property(bug), raising=False)
    await until_async(lambda: not daemon.is_ticking, "the end of the ticks")
    fed = systemd.listen().count("WATCHDOG=1")
    await asyncio.sleep(1.0)
    assert systemd.listen().count("WATCHDOG=1") == fed
    running.cancel()
    await asyncio.wait([running])


def test_a_failed_start_is_never_ready(start: Starter, systemd: Systemd) -> None:
    first = start.daemon("sim:")
    until(lambda: "READY=1" in systemd.listen(), "READY")
    systemd.received.clear()
    link = f"udpin:127.0.0.1:{first.port}"
    ended = run_naze_bridge("run", "--fc", "sim:", "--gcs", link, "--state-dir", start.directory / "other")
    assert ended.returncode == 1
    (sentence,) = [line for line in ended.stderr.splitlines() if not line.startswith("{")]
    assert sentence.startswith(f"naze-bridge: {link}")
    assert "in use" in sentence
    assert "READY=1" not in systemd.listen()
    assert first.is_alive


def test_a_service_manager_in_the_abstract_namespace_is_notified(tmp_path: Path) -> None:
    """systemd gives its name with a leading @."""
    name = f"naze-bridge-test-{tmp_path}"
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as systemd:
        systemd.bind(f"\0{name}")
        systemd.settimeout(TIMEOUT_S)
        notifier = Notifier({"NOTIFY_SOCKET": f"@{name}"})
        assert notifier.watchdog_s is None
        notifier.ready()
        assert systemd.recv(100) == b"READY=1"
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
