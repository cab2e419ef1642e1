# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission files and telemetry logs over HTTP, with and without the token."""

from http.client import HTTPConnection

import pytest

from service.web.access import MAX_FILE
from service.web.telemetry_logs import PIECE, TelemetryLogs
from tests.support.plan import plain_plan
from tests.support.programs import TIMEOUT_S
from tests.support.web_bench import EXAMPLE, Answer, WebBench

pytest_plugins = ("tests.support.web_fixtures",)

BINARY = "application/octet-stream"


def post(bench: WebBench, path: str, body: bytes, **headers: str) -> Answer:
    connection = HTTPConnection("127.0.0.1", bench.port, timeout=TIMEOUT_S)
    try:
        connection.request("POST", path, body, {"Content-Type": BINARY} | headers)
        response = connection.getresponse()
        return Answer(response.status, response.headers, response.read())
    finally:
        connection.close()


def test_a_check_changes_nothing(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    held, missions = web.board.records(), web.daemon.missions()
    answer = post(web, "/api/check?name=field.waypoints", EXAMPLE.read_bytes())
    assert answer.status == 200
    assert answer.data["verdict"] == "ACCEPTED"
    kinds = [row["kind"] for row in answer.data["rows"]]
    assert (kinds.count("changed"), kinds.count("dropped"), len(kinds)) == (6, 1, 14)
    assert (web.board.records(), web.daemon.missions()) == (held, missions)


def test_a_file_is_written_only_with_the_token(web: WebBench) -> None:
    web.daemon.push(plain_plan(9))
    for token in ("", "Bearer 2222222222222222"):
        answer = post(web, "/api/write?name=field.waypoints", EXAMPLE.read_bytes(), Authorization=token)
        assert answer.status == 403
    assert len(web.daemon.missions()) == 1


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"no mission", BINARY, 422),
        (b"", BINARY, 422),
        (b"QGC WPL 110\n", BINARY, 422),
        (b"[" * 100_000, BINARY, 422),
        (b"QGC WPL 110\n" + b"0\t1\t0\t16\t0\t0\t0\t0\t45.1\t8.1\t1\t1\n" * 501, BINARY, 422),
        (bytes(MAX_FILE + 1), BINARY, 413),
        (EXAMPLE.read_bytes(), "text/plain", 415),  # as another site's page could send it
    ],
)
def test_a_bad_file_gets_one_sentence(lasting_web: WebBench, body: bytes, kind: str, status: int) -> None:
    answer = post(lasting_web, "/api/check?name=a.waypoints", body, **{"Content-Type": kind})
    assert answer.status == status
    assert 0 < len(answer.data["error"]) < 300
    assert lasting_web.ask("/api/state").status == 200


def test_logs_need_the_token(lasting_web: WebBench) -> None:
    folder = lasting_web.daemon.state_dir / "logs"
    folder.mkdir(exist_ok=True)
    contents = bytes(range(256)) * (PIECE // 128)
    (folder / "2026-01-02 03-04-05.tlog").write_bytes(contents)
    (folder / "secret").write_bytes(b"other")
    path = "/api/logs/2026-01-02%2003-04-05.tlog"
    for url in ("/api/logs", path):
        assert lasting_web.ask(url).status == 403
    proof = {"Authorization": f"Bearer {lasting_web.token}"}
    listed = lasting_web.ask("/api/logs", **proof).data["logs"]
    assert {"name": "2026-01-02 03-04-05.tlog", "size": len(contents)} in listed
    assert "secret" not in [log["name"] for log in listed]
    first = lasting_web.ask(path, **proof).body
    assert first == contents[:PIECE]
    assert first + lasting_web.ask(f"{path}?start={PIECE}", **proof).body == contents
    for name in ("secret", "..%2Fweb-token", "2026-01-02%2003-04-06.tlog"):
        assert lasting_web.ask(f"/api/logs/{name}", **proof).status == 404


async def test_without_a_state_directory_there_are_no_logs() -> None:
    logs = TelemetryLogs(None)
    assert await logs.list() == {"logs": []}
    logs.close()


def test_the_history_of_the_serial_line_is_served(lasting_web: WebBench) -> None:
    history = lasting_web.ask("/api/link").data
    assert history["interval_s"] == 2
    assert set(history["samples"][0]) == {"round_trip_ms", "lost", "damaged"}
