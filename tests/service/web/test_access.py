# SPDX-License-Identifier: GPL-3.0-or-later
"""Access to the status page: reading, writing with the token, and bad requests."""

import socket
from itertools import product
from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.programs import TIMEOUT_S, until
from tests.support.web_bench import WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)

RESTORE = "/api/missions/1/restore"


def test_reading_does_not_need_a_token(shared_web: WebBench) -> None:
    page = shared_web.ask("/")
    assert (page.status, page.headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert shared_web.ask("/api/missions").data["missions"][0]["source"] == "push of naze-field.waypoints"


def test_every_response_has_security_headers(shared_web: WebBench) -> None:
    for path in ("/", "/page.js", "/api/state", "/api/missions/99", "/nothing"):
        headers = shared_web.ask(path).headers
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] == "no-store"
        assert not [name for name in headers if name.startswith("Access-Control")]
        assert "Set-Cookie" not in headers
        assert "Server" not in headers


STRANGERS = {
    "no token": {},
    "a wrong one": {"Authorization": "Bearer 2222222222222222"},
    "an empty one": {"Authorization": "Bearer "},
    "half of it": {"Authorization": "Bearer {half}"},
    "in a cookie": {"Cookie": "token={token}; Authorization=Bearer {token}"},
    "as a password": {"Authorization": "Basic {token}"},
    "in no header's place": {"X-Token": "{token}"},
    "letters that are none": {"Authorization": "Bearer \xff\xfe"},
}


@pytest.mark.parametrize("name", STRANGERS)
def test_restoring_needs_the_token(shared_web: WebBench, name: str) -> None:
    before = shared_web.daemon.missions()
    token = shared_web.token
    headers = {key: value.format(token=token, half=token[:8]) for key, value in STRANGERS[name].items()}
    answer = shared_web.ask(f"{RESTORE}?token={token}", "POST", **headers)
    assert (answer.status, answer.headers["www-authenticate"]) == (401, "Bearer")
    assert answer.data == {"error": "Wrong token. On the Pi, `sudo naze-bridge token` shows it."}
    assert shared_web.state()["write"] is None
    assert shared_web.daemon.missions() == before
    assert token not in shared_web.daemon.printed


def test_opening_a_url_cannot_restore_a_mission(shared_web: WebBench) -> None:
    answer = shared_web.ask(RESTORE, Authorization=f"Bearer {shared_web.token}")
    assert (answer.status, answer.headers["Allow"]) == (405, "POST")
    assert shared_web.ask(RESTORE, "OPTIONS", Origin="http://evil.example").status == 405
    assert shared_web.state()["write"] is None


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "[::1].evil.example", "local.evil.example."]
)
def test_a_public_host_name_is_refused(shared_web: WebBench, host: str) -> None:
    """DNS rebinding: a foreign site's name points to our address, and its page reads ours as its own."""
    answer = shared_web.ask("/api/state", Host=host)
    assert answer.status == 421
    assert "by the Pi's address" in answer.data["error"]


@pytest.mark.parametrize(
    "host", ["10.42.0.1:8080", "[fe80::1]:8080", "localhost", "naze", "naze.local:8080", "Naze.LOCAL", "naze.lan"]
)
def test_a_local_host_name_is_accepted(shared_web: WebBench, host: str) -> None:
    assert shared_web.ask("/api/state", Host=host).status == 200


def test_a_host_name_from_the_settings_is_accepted(start: Starter) -> None:
    page = web_daemon(start, web='hosts = ["Naze-1.example.ts.net"]')
    for path in ("/", "/api/state", "/metrics"):
        assert page.ask(path, Host="naze-1.Example.ts.net:8080").status == 200
    assert page.ask("/api/state", Host="naze-2.example.ts.net").status == 421


@pytest.mark.parametrize(
    "path",
    [
        "/nothing",
        "/../settings.py",
        "/%2e%2e/settings.py",
        "/static/../../settings.py",
        "/web-token",
        "/api/missions/0",
        "/api/missions/99",
        "/api/missions/-1",
        "/api/missions/1.5",
        "/api/missions/%00",
        "/api/missions/" + "9" * 300,
        "/api/missions/%D9%A2",  # a digit, but not ASCII
    ],
)
def test_a_missing_page_is_404_with_a_sentence(shared_web: WebBench, path: str) -> None:
    answer = shared_web.ask(path)
    assert answer.status == 404
    assert answer.data["error"]
    assert answer.data["error"].isprintable()


def raw(bench: WebBench, *parts: bytes) -> bytes:
    """Send raw bytes; return the whole response."""
    with bench.connect() as connection:
        answer = b""
        try:
            for part in parts:
                connection.sendall(part)
            connection.shutdown(socket.SHUT_WR)
            while data := connection.recv(65536):
                answer += data
        except OSError:
            pass  # disconnected before everything was sent
        return answer


BAD_REQUESTS = {
    "noise": [bytes(range(256)) * 8],
    "a TLS hello": [b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500)],
    "a line without end": [b"GET /" + b"a" * (1 << 20)],
    "a header without end": [b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * (1 << 20)],
    "headers without end": [b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: a\r\n" * 100_000],
    "two lengths": [
        b"POST /api/missions/1/restore HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nxx"
    ],
    "an invalid length": [b"POST /api/missions/1/restore HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n"],
    "no host": [b"GET / HTTP/1.0\r\n\r\n"],
    "half a request": [b"GET /api/state HTTP/1.1\r\nHost: loc"],
    "many at once": [b"GET /api/missions/1 HTTP/1.1\r\nHost: localhost\r\n\r\n" * 1000],
    "an upgrade": [b"GET /api/state HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\r\n"],
}


@pytest.mark.parametrize("name", BAD_REQUESTS)
def test_bad_bytes_end_only_their_connection(shared_web: WebBench, name: str) -> None:
    answer = raw(shared_web, *BAD_REQUESTS[name])
    assert answer.count(b"HTTP/1.") <= 1  # a connection carries one request
    assert shared_web.ask("/api/state").status == 200
    assert "Traceback" not in shared_web.daemon.printed


def test_malformed_chunks_do_not_raise(web: WebBench) -> None:
    bodies = (b"zz\r\n", b"-1\r\n\r\n", b"1\r\nabc\r\n", b"f" * 40, b"1;" + b"a" * 70_000, b"0\r\n\xff\r\n\r\n")
    for method in (b"GET /api/state", b"POST /api/check", b"POST /api/missions/1/restore"):
        head = b"%b HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n" % method
        for start, body in product((head, head + b"1\r\na\r\n"), bodies):
            raw(web, start, body)
            raw(web, start + body)
    assert web.ask("/api/state").status == 200
    for sign in ("Traceback", "exc_info", "web.failed"):
        assert sign not in web.daemon.printed


@pytest.mark.parametrize("head", [b"Content-Length: 1000000000000", b"Transfer-Encoding: chunked"])
def test_a_huge_body_is_refused_unread(shared_web: WebBench, head: bytes) -> None:
    before = resident_kb(shared_web.daemon.process.pid)
    chunk = b"100000\r\n" + bytes(1 << 20) + b"\r\n"
    start = b"POST %b HTTP/1.1\r\nHost: a\r\nAuthorization: Bearer %b\r\n%b\r\n\r\n"
    answer = raw(shared_web, start % (RESTORE.encode(), shared_web.token.encode(), head), *[chunk] * 64)
    assert not answer or answer.startswith(b"HTTP/1.1 413")
    assert shared_web.state()["write"] is None
    assert resident_kb(shared_web.daemon.process.pid) - before < 8 << 10


def resident_kb(pid: int) -> int:
    return int(Path(f"/proc/{pid}/status").read_text().partition("VmRSS:")[2].split()[0])


def test_one_address_does_not_lock_out_another(web: WebBench) -> None:
    """Dozens of silent connections, then a pilot from another address."""
    silent = [socket.create_connection(("127.0.0.1", web.port), TIMEOUT_S) for _ in range(60)]
    try:
        with socket.create_connection(("127.0.0.1", web.port), TIMEOUT_S, ("127.0.0.2", 0)) as pilot:
            pilot.sendall(b"GET /api/state HTTP/1.1\r\nHost: 10.42.0.1\r\n\r\n")
            assert pilot.recv(100).startswith(b"HTTP/1.1 200")
    finally:
        for connection in silent:
            connection.close()
    assert web.ask("/api/state").status == 200


def test_without_the_setting_there_is_no_page(start: Starter) -> None:
    daemon = start.daemon("sim:")
    daemon.wait()
    assert daemon.has_logged("web.listening") is None


def test_a_page_that_cannot_be_served_does_not_affect_the_bridge(start: Starter) -> None:
    """As with an access point address that is not up yet, or an occupied port."""
    with socket.socket() as owner:
        owner.bind(("127.0.0.1", 0))
        owner.listen()
        port = owner.getsockname()[1]
        config = start.directory / "late.toml"
        config.write_text(f'web = {{listen = "127.0.0.1:{port}"}}\n')
        daemon = start.daemon("sim:", options=("--config", str(config)))
        daemon.wait()
        event = until(lambda: daemon.has_logged("web.unavailable"), "a log entry about the page")
        assert event["address"] == f"127.0.0.1:{port}"
    until(lambda: daemon.has_logged("web.listening"), "the page")
    assert daemon.end() == 0


def test_without_a_token_the_page_is_read_only(start: Starter) -> None:
    token_file = start.directory / "token"
    token_file.write_text("short")
    token_file.chmod(0o600)
    web = web_daemon(start, web='token_file = "token"')
    event = until(lambda: web.daemon.has_logged("web.no_token"), "a log entry about the token")
    assert event["why"].startswith(f"the token in {token_file} is shorter than 12 characters")
    answer = web.ask(RESTORE, "POST", Authorization="Bearer short")
    assert answer.status == 403
    assert answer.data["error"].startswith("This page is read-only")
    assert str(token_file) not in answer.data["error"]
    assert web.ask("/api/state").status == 200


def test_a_stop_closes_the_browsers_connections(web: WebBench) -> None:
    with web.connect() as silent:
        assert web.ask("/api/state").status == 200
        assert web.daemon.end() == 0
        assert silent.recv(1) == b""
    assert "Traceback" not in web.daemon.printed


def test_only_the_listed_web_applications_may_use_the_interface(start: Starter) -> None:
    web = web_daemon(start, web='origins = ["https://fleet.example.org"]')
    for origin, allowed in (("https://fleet.example.org", "https://fleet.example.org"), ("https://evil.example", None)):
        asked = {"Origin": origin, "Access-Control-Request-Method": "POST"}
        preflight = web.ask("/api/pi", "OPTIONS", **asked, **{"Access-Control-Request-Headers": "authorization"})
        assert (preflight.status == 200, preflight.headers["access-control-allow-origin"]) == (bool(allowed), allowed)
        assert web.ask("/api/state", Origin=origin).headers["access-control-allow-origin"] == allowed


def test_other_origins_are_refused_by_default(shared_web: WebBench) -> None:
    answer = shared_web.ask("/api/state", Origin="https://fleet.example.org")
    assert "access-control-allow-origin" not in answer.headers
    assert shared_web.ask("/api/pi", "OPTIONS", Origin="https://fleet.example.org").status == 405
