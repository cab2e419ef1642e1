# SPDX-License-Identifier: GPL-3.0-or-later
"""A write started on the page always ends with a sentence."""

import asyncio

from structlog.testing import capture_logs

from payloads.mission_data import Json
from service.web.mission_files import MissionWriter, Progress


async def test_an_unexpected_error_ends_the_write_with_a_sentence() -> None:
    async def fail(_progress: Progress) -> Json:
        raise KeyError("ack")

    writer = MissionWriter()
    with capture_logs() as events:
        writer.begin("field.waypoints", fail)
        for _ in range(5):
            await asyncio.sleep(0)
    assert writer.state is not None
    assert (writer.state["done"], writer.state["ok"]) == (True, False)
    assert writer.state["text"] == "The daemon failed during the write; see its log."
    assert [event["event"] for event in events] == ["web.failed"]
