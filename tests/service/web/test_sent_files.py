# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission files and telemetry logs over HTTP, with and without the token."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from http.client import HTTPConnection
from typing import Any, cast

import pytest
from starlette.requests import Request
from structlog.testing import capture_logs

from payloads.mission_data import Json
from protocols.mission_item import MissionItem
from service.daemon.api import DaemonApi
from service.web import sent_files
from service.web.sent_files import MissionWriter, Progress, SentFiles
from tests.support.plan import plain_plan, plan_text
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


def test_a_check_is_read_only(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    held, missions = web.board.records(), web.daemon.missions()
    answer = post(web, "/api/check?name=field.waypoints", EXAMPLE.read_bytes())
    assert answer.status == 200
    assert answer.data["verdict"] == "ACCEPTED"
    kinds = [row["kind"] for row in answer.data["rows"]]
    assert (kinds.count("changed"), kinds.count("dropped"), len(kinds)) == (6, 1, 14)
    assert (web.board.records(), web.daemon.missions()) == (held, missions)


def test_a_check_names_the_other_contents_of_the_file(web: WebBench) -> None:
    fence = b'"geoFence": {"circles": [{}]}'
    plan = (EXAMPLE.with_suffix(".plan").read_bytes().rstrip()[:-1]) + b"," + fence + b"}"
    answer = post(web, "/api/check?name=field.plan", plan)
    assert "the plan also contains a fence: ignored" in answer.data["findings"]


def test_a_file_is_written_only_with_the_token(web: WebBench) -> None:
    web.daemon.push(plain_plan(9))
    for token in ("", "Bearer 2222222222222222"):
        answer = post(web, "/api/write?name=field.waypoints", EXAMPLE.read_bytes(), Authorization=token)
        assert answer.status == 401
    assert len(web.daemon.missions()) == 1


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"no mission", BINARY, 422),
        (b"", BINARY, 422),
        (b"QGC WPL 110\n", BINARY, 422),
        (b"[" * 100_000, BINARY, 422),
        (b"QGC WPL 110\n" + b"0\t1\t0\t16\t0\t0\t0\t0\t45.1\t8.1\t1\t1\n" * 501, BINARY, 422),
        (bytes((256 << 10) + 1), BINARY, 413),
        (EXAMPLE.read_bytes(), "text/plain", 415),  # as another site's page could send it
    ],
)
def test_a_bad_file_gets_one_sentence(shared_web: WebBench, body: bytes, kind: str, status: int) -> None:
    answer = post(shared_web, "/api/check?name=a.waypoints", body, **{"Content-Type": kind})
    assert answer.status == status
    assert answer.data["error"]
    assert answer.data["error"].isprintable()
    assert shared_web.ask("/api/state").status == 200


async def test_an_unexpected_error_ends_the_write_with_a_sentence() -> None:
    async def fail(_progress: Progress) -> Json:
        raise KeyError("ack")

    writer = MissionWriter()
    with capture_logs() as events:
        writer.write("field.waypoints", fail)
        for _ in range(5):
            await asyncio.sleep(0)
    assert writer.state is not None
    assert (writer.state["done"], writer.state["ok"]) == (True, False)
    assert writer.state["text"] == "The daemon failed; see its log."
    assert [event["event"] for event in events] == ["web.failed"]


class Api:
    async def check(self, items: list[MissionItem]) -> Json:
        return {"count": len(items)}


def request(receive: Callable[[], Awaitable[Any]]) -> Request:
    headers = [(b"content-type", b"application/octet-stream")]
    return Request({"type": "http", "method": "POST", "query_string": b"", "headers": headers}, receive)


async def test_a_check_does_not_wait_for_a_slow_upload(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never() -> Any:
        await asyncio.Event().wait()

    async def whole() -> Any:
        return {"type": "http.request", "body": plan_text(plain_plan(5)).encode(), "more_body": False}

    monkeypatch.setattr(sent_files, "checked_mission", lambda _items, verdict: verdict | {"findings": []})
    files = SentFiles(cast("DaemonApi", Api()), MissionWriter())
    slow = asyncio.create_task(files.check(request(never)))
    await asyncio.sleep(0)
    response = await asyncio.wait_for(files.check(request(whole)), TIMEOUT_S)
    assert json.loads(bytes(response.body))["count"] > 0
    slow.cancel()
