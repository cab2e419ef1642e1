# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's control socket: bad requests get an error, and only a signal ends the daemon."""

import json
import signal
import socket
from pathlib import Path

import pytest

from service.daemon.client import ControlError
from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import Daemon, run_naze_bridge, until

ITEM = {"seq": 0, "command": 16, "frame": 3, "p1": 0, "p2": 0, "p3": 0, "p4": 0, "lat_e7": 1, "lon_e7": 1, "alt_m": 1}


def push(**changes: object) -> bytes:
    return json.dumps({"do": "push", "source": "test", "items": [ITEM | changes]}).encode()


BAD_REQUESTS = {
    "nothing": b"",
    "no JSON": b"status",
    "no text": b"\xff\xfe\x00",
    "no object": b"[]",
    "a number": b"12",
    "nothing to do": b"{}",
    "nothing known": b'{"do": "arm"}',
    "no word": b'{"do": ["status"]}',
    "a huge number": b'{"do": "mission", "number": 99999999999999999999}',
    "an infinite number": b'{"do": "mission", "number": 1e999}',
    "no number": b'{"do": "missions", "limit": "all"}',
    "less than nothing": b'{"do": "missions", "limit": -1}',
    "digits without end": b'{"do": "mission", "number": %b}' % (b"9" * 5000),
    "brackets without end": b"[" * 100_000,
    "no items": b'{"do": "push", "source": "test"}',
    "an empty item": b'{"do": "push", "source": "test", "items": [[]]}',
    "half an item": b'{"do": "push", "source": "test", "items": [{"seq": 0}]}',
    "a parameter as text": push(p1="much"),
    "a parameter too large for a float": push(p1=10**400),
    "a latitude as text": push(lat_e7="here"),
    "a latitude too large for a float": push(lat_e7=10**400),
    "an invalid command": push(command=-1),
}


def send(daemon: Daemon, line: bytes) -> dict[str, object]:
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(str(daemon.state_dir / "control.sock"))
        connection.sendall(line + b"\n")
        connection.shutdown(socket.SHUT_WR)
        answer: dict[str, object] = json.loads(connection.makefile().readline())
        return answer


def test_bad_requests_are_answered_without_effect(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    daemon.push(plain_plan(5))
    held = daemon.pull()
    for name, line in BAD_REQUESTS.items():
        answer = send(daemon, line)
        assert list(answer) == ["error"], name
        assert "\n" not in str(answer["error"]), name
    with pytest.raises(ControlError, match="limited to 256 kB: this mission is longer than any"):
        daemon.ask({"do": " " * (64 << 20)})
    assert daemon.pull() == held
    daemon.push(plain_plan(6))
    assert daemon.end() == 0
    assert "Traceback" not in daemon.printed


def test_a_client_may_disconnect_before_the_reply(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    for line in (b'{"do": "pull"}\n', b'{"do": "missions", "limit": 5}\n', b'{"do":'):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(daemon.state_dir / "control.sock"))
            connection.sendall(line)
    daemon.push(plain_plan(5))
    assert daemon.end() == 0
    assert "Traceback" not in daemon.printed


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_waiting_clients_are_informed_of_a_stop(start: Starter, number: signal.Signals) -> None:
    """One client is idle, another waits for a push to a hung flight controller."""
    bench = start.bench()
    daemon = bench.daemon
    with socket.socket(socket.AF_UNIX) as idle, socket.socket(socket.AF_UNIX) as pushing:
        for connection in (idle, pushing):
            connection.connect(str(daemon.state_dir / "control.sock"))
        bench.board.set("hang 1")
        pushing.sendall(push() + b"\n")
        assert daemon.status() is not None  # accepted after the push, which has therefore begun
        assert daemon.end(number) == 0
        answer = json.loads(pushing.makefile().readline())
        assert "was stopped" in answer.get("error", "") or answer["result"]["ack"] == "MAV_MISSION_DENIED"
    assert "Traceback" not in daemon.printed
    assert not (daemon.state_dir / "control.sock").exists()


def test_a_path_too_long_for_a_socket_is_reported_in_one_sentence(tmp_path: Path) -> None:
    state = tmp_path / ("long" * 30)
    ended = run_naze_bridge("run", "--fc", "sim:", "--gcs", "udpout:127.0.0.1:9", "--state-dir", state)
    assert ended.returncode == 1
    (sentence,) = [line for line in ended.stderr.splitlines() if not line.startswith("{")]
    assert sentence.startswith("naze-bridge: the control socket ")
    assert str(state) in sentence


def test_actions_of_the_command_line_are_logged(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    daemon.push(plain_plan(5))
    event = until(lambda: daemon.has_logged("mission.push_ended"), "a log entry about the push")
    assert (event["source"], event["ack"], event["mission"]) == ("test", "ACCEPTED", 1)
    assert event["detail"].startswith("5 of 5 stored: ")
    daemon.try_clear()
    until(lambda: len([one for one in daemon.events() if one["event"] == "mission.push_ended"]) == 2, "and the clear")
