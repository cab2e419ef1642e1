# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrong options and machine problems at the daemon's start: one clear sentence each."""

import os
import socket
import subprocess
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import TIMEOUT_S, free_port, run_naze_bridge, until


def assert_refused(ended: subprocess.CompletedProcess[str], *parts: str) -> None:
    assert ended.returncode == 1
    (sentence,) = [line for line in ended.stderr.splitlines() if not line.startswith("{")]
    assert sentence.startswith("naze-bridge: ")
    for part in parts:
        assert part in sentence


def test_a_second_daemon_on_one_state_directory_is_refused(start: Starter) -> None:
    first = start.daemon("sim:")
    first.wait_up()
    link = f"udpin:127.0.0.1:{free_port()}"
    ended = run_naze_bridge("run", "--fc", "sim:", "--gcs", link, "--state-dir", str(first.state_dir))
    assert_refused(ended, str(first.state_dir), "in use by process", "--state-dir")
    # The first one still answers.
    first.wait()


# -- the serial port -----------------------------------------------------------------------------------------


def complaint(start: Starter, path: Path) -> str:
    """The daemon's message about its port; the daemon keeps running."""
    daemon = start.daemon(str(path))
    event = until(lambda: daemon.has_logged("fc.port_unavailable"), "a complaint")
    assert daemon.is_alive
    why: str = event["why"]
    return why


@pytest.fixture
def terminal() -> Iterator[Path]:
    """A serial port with nothing connected."""
    near, far = os.openpty()
    tty.setraw(far)
    path = Path(os.ttyname(far))
    os.close(far)
    yield path
    os.close(near)


def test_a_missing_port_is_opened_when_it_appears(start: Starter) -> None:
    daemon = start.daemon(str(start.directory / "naze"))
    event = until(lambda: daemon.has_logged("fc.port_unavailable"), "a complaint")
    assert "is missing: plug the flight controller in" in event["why"]
    with udp_station(daemon.address) as station:
        # Ground stations still see a vehicle, which gives the reason for refusing missions.
        station.send_heartbeat()
        assert station.upload(plain_plan(12)) == 14
    board = start.board()
    daemon.wait()
    with udp_station(daemon.address) as station:
        assert station.upload(plain_plan(12)) == 0
    assert board.records() == records_of(judge(plain_plan(12)))
    # It was reported once, not four times a second.
    assert len([event for event in daemon.events() if event["event"] == "fc.port_unavailable"]) == 1


@pytest.mark.parametrize("path", ["/dev/null", __file__])
def test_a_port_that_is_not_a_serial_port_is_reported(start: Starter, path: str) -> None:
    assert "is not a serial port" in complaint(start, Path(path))


def test_a_port_used_by_a_login_console_is_reported(start: Starter, terminal: Path) -> None:
    with subprocess.Popen(
        ["/sbin/agetty", "-c", "input()", terminal.name], executable=sys.executable, stdin=subprocess.PIPE
    ) as console:
        why = complaint(start, terminal)
        assert "login console" in why
        assert f"serial-getty@{terminal.name}.service" in why
        console.kill()


def test_a_tcp_flight_controller_is_found_once_it_is_up(start: Starter) -> None:
    port = free_port(socket.SOCK_STREAM)
    daemon = start.daemon(f"tcp:127.0.0.1:{port}")
    event = until(lambda: daemon.has_logged("fc.port_unavailable"), "a complaint")
    assert f"tcp:127.0.0.1:{port} cannot be reached" in event["why"]
    with socket.create_server(("127.0.0.1", port)) as server:
        server.settimeout(TIMEOUT_S)
        connection, _ = server.accept()
        with connection:
            connection.settimeout(TIMEOUT_S)
            assert connection.recv(100)
    assert daemon.is_alive


# -- the store -----------------------------------------------------------------------------------------------


def test_a_corrupt_database_is_set_aside(start: Starter) -> None:
    state = start.directory / "state"
    state.mkdir()
    rubbish = bytes(range(256)) * 64
    (state / "missions.db").write_bytes(rubbish)
    daemon = start.daemon("sim:", state_dir=state)
    daemon.wait()
    event = until(lambda: daemon.has_logged("store.damaged"), "a word about the database")
    assert Path(event["kept_as"]).read_bytes() == rubbish
    with udp_station(daemon.address) as station:
        station.send_heartbeat()
        assert station.upload(plain_plan(12)) == 0
    assert [mission["outcome"] for mission in daemon.missions()] == ["VERIFIED"]
