# SPDX-License-Identifier: GPL-3.0-or-later
"""A connection to the helper: one user, one request, one reply."""

import fcntl
import json
import os
import socket
from pathlib import Path
from typing import Any

import pytest

from service.cli.helper.action import ThisPi
from service.cli.helper.serve import answer
from tests.support.fixable_pi import FixablePi


@pytest.fixture
def lock(tmp_path: Path) -> Path:
    file = tmp_path / "lock"
    file.touch()
    return file


_RESTART = b'{"action": "fix", "fix": "restart the bridge"}'


def served(pi: FixablePi, lock: Path, request: bytes, user: int | None = None, unit: str = "change") -> dict[str, Any]:
    ours, theirs = socket.socketpair()
    with ours, theirs, theirs.makefile("rb") as body:
        ours.sendall(request + b"\n")
        ours.shutdown(socket.SHUT_WR)
        answer(theirs, ThisPi(pi, body), {os.geteuid() if user is None else user}, lock, unit)
        line = ours.recv(1 << 20)
    assert line.endswith(b"\n")
    reply: dict[str, Any] = json.loads(line)
    return reply


def test_a_request_is_answered(pi: FixablePi, lock: Path) -> None:
    assert served(pi, lock, b'{"action": "overview"}', unit="look")["name"] == "kite"


def test_another_user_is_refused(pi: FixablePi, lock: Path) -> None:
    reply = served(pi, lock, _RESTART, user=os.geteuid() + 1)
    assert reply == {"error": "Only the user naze-bridge may ask for this."}
    assert pi.ran == []


@pytest.mark.parametrize(
    ("request_line", "why"),
    [
        (b"GET / HTTP/1.1", "not an action"),
        (b'{"action": "downgrade"}', "not an action; the actions are fix, answer, settings"),
        (b'{"action": "answer", "name": "\\ud800"}', "not an action"),
        (b'{"action": "answer", "hotspot": "a\\nb", "password": "long-enough"}', "not a network name"),
        (b'{"action": "answer", "hotspot": "a", "password": "12345678\\u0000"}', "a Wi-Fi password"),
        (b'{"action": "answer", "name": "a\\n"}', "not a host name"),
        (b'{"action": "answer", "country": "Germany"}', "'Germany' is not a country code"),
        (b'{"action": "settings", "values": {"sysid": 0}}', "MAVLink system id cannot have this value"),
    ],
)
def test_every_refusal_is_a_sentence(pi: FixablePi, lock: Path, request_line: bytes, why: str) -> None:
    assert why in served(pi, lock, request_line)["error"]


def test_one_change_at_a_time(pi: FixablePi, lock: Path) -> None:
    with lock.open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert "Another change" in served(pi, lock, _RESTART)["error"]
    assert pi.ran == []
    assert "error" not in served(pi, lock, _RESTART)


def test_a_refusal_arrives_although_the_body_was_not_read(pi: FixablePi, lock: Path) -> None:
    request = b'{"action": "install", "size": 0}\n' + bytes(100_000)
    assert "at most 128 MB" in served(pi, lock, request, unit="update")["error"]
