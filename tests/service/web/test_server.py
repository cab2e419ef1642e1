# SPDX-License-Identifier: GPL-3.0-or-later

import json
from collections.abc import MutableMapping
from contextlib import suppress
from typing import Any, cast

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from structlog.testing import capture_logs

from service.daemon.client import ControlError
from service.settings.web import WebSettings
from service.web.access import route
from service.web.api import Api
from service.web.server import _config
from service.web.token import TokenError
from storage.store_error import StoreError


class _BrokenApi:
    def __init__(self, error: Exception) -> None:
        self._error = error

    def routes(self) -> list[Route]:
        async def fail(_request: Request) -> Response:
            raise self._error

        return [route("GET", "/api/state", fail)]


async def ask(error: Exception) -> tuple[MutableMapping[str, Any], Any]:
    """The start and the JSON body of the response to a request that raises an error."""
    sent: list[MutableMapping[str, Any]] = []

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(message)

    async def receive() -> MutableMapping[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    config = _config(cast("Api", _BrokenApi(error)), WebSettings(), TokenError("none"))
    scope = {"type": "http", "method": "GET", "path": "/api/state", "headers": [(b"host", b"127.0.0.1")]}
    # Starlette passes a fault on to uvicorn, whose log is off.
    with suppress(KeyError):
        await cast("Any", config.app)(scope | {"query_string": b""}, receive, send)
    start, body = sent
    return start, json.loads(body["body"])


async def test_a_fault_is_logged_and_answered_with_a_sentence() -> None:
    with capture_logs() as events:
        start, body = await ask(KeyError("armed"))
    assert [event["event"] for event in events] == ["web.failed"]
    assert start["status"] == 500
    assert (b"x-content-type-options", b"nosniff") in start["headers"]
    assert body == {"error": "The daemon failed to answer; see its log."}


@pytest.mark.parametrize(("error", "status"), [(ControlError("none"), 404), (StoreError("full"), 503)])
async def test_the_stores_errors_become_refusals(error: Exception, status: int) -> None:
    start, body = await ask(error)
    assert (start["status"], body) == (status, {"error": str(error)})
