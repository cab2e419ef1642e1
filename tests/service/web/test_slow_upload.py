# SPDX-License-Identifier: GPL-3.0-or-later
"""A phone that sends its file slowly does not hold up the check of another one's."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, cast

import pytest
from starlette.requests import Request

from payloads.mission_data import Json
from protocols.mission_item import MissionItem
from service.daemon.api import DaemonApi
from service.web import mission_files
from service.web.mission_files import MissionFiles, MissionWriter
from tests.support.plan import plain_plan, plan_text
from tests.support.programs import TIMEOUT_S


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

    monkeypatch.setattr(mission_files, "checked_mission", lambda _items, verdict: verdict)
    files = MissionFiles(cast("DaemonApi", Api()), MissionWriter())
    slow = asyncio.create_task(files.check(request(never)))
    await asyncio.sleep(0)
    assert (await asyncio.wait_for(files.check(request(whole)), TIMEOUT_S))["count"] > 0
    slow.cancel()
