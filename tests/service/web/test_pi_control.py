# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests about the Pi: with the token, from the Pi's own network, disarmed."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request

from service.cli.helper import packages
from service.web.pi_control import PiControl, is_local
from service.web.sent_files import MissionWriter
from service.web.token import Token
from tests.support.fixable_pi import FixablePi
from tests.support.helper_bench import helper_bench
from tests.support.programs import until
from tests.support.web_bench import Answer, WebBench

_RESTART = b'{"action": "fix", "fix": "restart the bridge"}'
_JSON, _DATA = ({"Content-Type": f"application/{kind}"} for kind in ("json", "octet-stream"))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[WebBench, FixablePi]]:
    with pytest.MonkeyPatch.context() as patch, helper_bench(tmp_path_factory.mktemp("pi"), patch) as both:
        yield both


@pytest.fixture
def web(bench: tuple[WebBench, FixablePi]) -> WebBench:
    return bench[0]


@pytest.fixture
def pi(bench: tuple[WebBench, FixablePi]) -> FixablePi:
    return bench[1]


def post(web: WebBench, path: str, body: bytes, token: str | None = None) -> Answer:
    authorization = {"Authorization": f"Bearer {web.token if token is None else token}"}
    return web.post(path, body, **(_JSON if path == "/api/pi" else _DATA), **authorization)


def result(web: WebBench, request: dict[str, Any]) -> dict[str, Any]:
    """The end of a request, as the page waits for it."""
    answer = post(web, "/api/pi", json.dumps(request).encode())
    assert answer.status == 202, answer

    def ended() -> dict[str, Any] | None:
        job: dict[str, Any] = web.ask("/api/pi", Authorization=f"Bearer {web.token}").data
        assert job["id"] == answer.data["id"]
        return job if job["done"] else None

    job: dict[str, Any] = until(ended, "the reply")
    return job


def test_a_request_is_carried_out_by_the_helper(web: WebBench, pi: FixablePi) -> None:
    assert result(web, {"action": "overview"})["reply"]["name"] == "kite"
    result(web, {"action": "settings", "values": {"sysid": 9}})
    assert "sysid = 9" in pi.read("/etc/naze-bridge/page.toml")


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        ({"action": "overview", "command": "id"}, "The arguments of this action"),
        ({"action": "fix", "fix": "rm -rf /"}, "no change any more"),
        ({"action": "settings", "values": {"sysid": "seven"}}, "MAVLink system id cannot have this value"),
    ],
)
def test_a_refusal_of_the_helper_is_shown(web: WebBench, pi: FixablePi, request_: dict[str, Any], why: str) -> None:
    assert why in result(web, request_)["error"]
    assert not [command for command in pi.ran if "rm" in command.split()]


@pytest.mark.parametrize("path", ["/api/pi", "/api/log"])
def test_reading_needs_the_token(web: WebBench, path: str) -> None:
    assert web.ask(path).status == 401
    assert web.ask(path, Authorization="Bearer wrong").status == 401


@pytest.mark.parametrize("path", ["/api/pi", "/api/pi/package?start=0"])
def test_changing_needs_the_token_and_the_header(web: WebBench, path: str) -> None:
    for authorization in ({}, {"Authorization": "Bearer wrong"}, {"Cookie": f"token={web.token}"}):
        assert web.post(path, _RESTART, **_JSON, **authorization).status == 401


def test_a_form_of_another_site_is_refused(web: WebBench) -> None:
    headers = {"Authorization": f"Bearer {web.token}", "Content-Type": "text/plain"}
    assert web.post("/api/pi", _RESTART, **headers).status == 415


@pytest.mark.parametrize(
    "body", [b"", b"7", b"[]", b"{}", b"\xff", b"{" * 5000, b'{"action": "shell"}', b'{"action": ["fix"]}']
)
def test_invalid_requests_are_refused(web: WebBench, body: bytes) -> None:
    assert post(web, "/api/pi", body).status == 422


def test_refuses_changes_while_the_craft_is_armed(web: WebBench) -> None:
    assert web.board is not None
    web.board.set("armed 1")
    until(lambda: web.state()["last_heard"]["armed"], "the armed craft")
    try:
        for action in ("fix", "answer", "settings", "install", "downgrade"):
            answer = post(web, "/api/pi", json.dumps({"action": action}).encode())
            assert (answer.status, answer.data) == (409, {"error": "The craft is armed: disarm it first."})
        assert post(web, "/api/pi/package?start=0", b"x").status == 409
        assert "reply" in result(web, {"action": "overview"})
    finally:
        web.board.set("armed 0")
        until(lambda: web.state()["last_heard"]["armed"] is False, "the disarmed craft")


def test_refuses_changes_while_firmware_is_flashed(tmp_path: Path) -> None:
    report = SimpleNamespace(last_heard=SimpleNamespace(armed=False))
    daemon: Any = SimpleNamespace(report=lambda: report, fc=SimpleNamespace(is_lent=True))
    token = Token(tmp_path / "token")
    control = PiControl(daemon, MissionWriter())
    begin = next(
        route.endpoint for route in control.routes() if route.path == "/api/pi" and "POST" in (route.methods or ())
    )
    body = _RESTART
    head = {"host": "10.42.0.1", "authorization": f"Bearer {token.path.read_text()}", "content-length": str(len(body))}
    head["content-type"] = _JSON["Content-Type"]
    scope = {
        "type": "http",
        "method": "POST",
        "path": "/api/pi",
        "query_string": b"",
        "headers": [(name.encode(), value.strip().encode()) for name, value in head.items()],
        "client": ("10.42.0.7", 4711),
        "app": SimpleNamespace(state=SimpleNamespace(hosts=(), token=token)),
    }

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body}

    with pytest.raises(HTTPException, match="New firmware is being flashed"):
        asyncio.run(begin(Request(scope, receive)))


def test_a_package_in_pieces(web: WebBench, monkeypatch: pytest.MonkeyPatch) -> None:
    received: list[bytes] = []

    def receive(pi: Any, size: int) -> str:
        received.append(pi.body.read(size))
        return "9.9"

    monkeypatch.setattr(packages, "receive", receive)
    monkeypatch.setattr("service.cli.helper.actions.receive", receive)
    pieces = [bytes([number]) * 200_000 for number in range(3)]
    for number, piece in enumerate(pieces):
        assert post(web, f"/api/pi/package?start={200_000 * number}", piece).data == {"size": 200_000 * (number + 1)}
    # The kernel removes a file without a name when the daemon ends.
    assert [path for path in web.daemon.state_dir.rglob("*") if path.is_file() and path.stat().st_size == 600_000] == []
    assert post(web, "/api/pi/package?start=200000", b"x").status == 409  # a lost or repeated piece
    assert result(web, {"action": "install"})["reply"] == {"version": "9.9"}
    assert received == [b"".join(pieces)]
    assert "Send the package first" in result(web, {"action": "install"})["error"]


def test_a_piece_is_limited_like_every_file(web: WebBench) -> None:
    assert post(web, "/api/pi/package?start=0", bytes(300 << 10)).status == 413


def test_an_installation_without_a_package(web: WebBench) -> None:
    assert "Send the package first" in result(web, {"action": "install"})["error"]


def test_the_log_continues_where_it_was_read(web: WebBench) -> None:
    def read(after: int) -> dict[str, Any]:
        log: dict[str, Any] = web.ask(f"/api/log?after={after}", Authorization=f"Bearer {web.token}").data
        return log

    first = read(0)
    assert any("Status page listening" in line["text"] for line in first["lines"])
    assert first["count"] >= len(first["lines"])
    result(web, {"action": "overview"})
    later = [line["text"] for line in read(first["count"])["lines"]]
    assert "Status page pi request: action overview, peer 127.0.0.1" in later
    assert not any("Status page listening" in text for text in later)


@pytest.mark.parametrize(
    "peer", ["127.0.0.1", "10.42.0.17", "192.168.1.2", "172.16.0.1", "169.254.1.1", "fe80::1%wlan0", "fd00::1", "::1"]
)
def test_the_pis_own_network(peer: str) -> None:
    assert is_local(peer)


@pytest.mark.parametrize("peer", ["8.8.8.8", "100.64.0.1", "2001:4860:4860::8888", "::ffff:8.8.8.8"])
def test_another_network(peer: str) -> None:
    assert not is_local(peer)


def test_without_a_helper(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with helper_bench(tmp_path, monkeypatch) as (web, _):
        (tmp_path / "naze-bridge-helper-look.sock").unlink()
        assert "cannot be reached" in result(web, {"action": "overview"})["error"]
