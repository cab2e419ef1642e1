# SPDX-License-Identifier: GPL-3.0-or-later

import json
from collections.abc import MutableMapping
from typing import Any, cast

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from structlog.testing import capture_logs

from service.web.access import guarded
from service.web.api import Api
from service.web.server import _config


class _BrokenApi:
    def image_origin(self) -> str:
        return ""

    def routes(self) -> list[Route]:
        async def fail(_request: Request) -> Response:
            raise KeyError("armed")

        return [Route("/api/state", guarded(fail))]


async def test_a_fault_is_logged_and_answered_with_a_sentence() -> None:
    sent: list[MutableMapping[str, Any]] = []

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(message)

    async def receive() -> MutableMapping[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    config = _config(cast("Api", _BrokenApi()), ())
    scope = {"type": "http", "method": "GET", "path": "/api/state", "headers": [(b"host", b"127.0.0.1")]}
    # Starlette passes it on to uvicorn, whose log is off.
    with capture_logs() as events, pytest.raises(KeyError):
        await cast("Any", config.app)(scope | {"query_string": b""}, receive, send)
    assert [event["event"] for event in events] == ["web.failed"]
    start, body = sent
    assert start["status"] == 500
    assert (b"x-content-type-options", b"nosniff") in start["headers"]
    assert json.loads(body["body"]) == {"error": "The daemon failed to answer; see its log."}
