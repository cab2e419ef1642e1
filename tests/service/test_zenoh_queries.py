# SPDX-License-Identifier: GPL-3.0-or-later
"""Every query gets a last reply, also if the daemon fails."""

from typing import Any, cast

import zenoh
from structlog.testing import capture_logs

from service.settings.zenoh import PayloadEncoding
from service.zenoh_link import keys
from service.zenoh_link.payload import Payloads
from service.zenoh_link.queries import Queries, Question
from service.zenoh_link.session import Job, SessionThread


class FakeThread:
    """Runs the replies at once."""

    def submit(self, job: Job, *, is_reply: bool) -> None:
        assert is_reply
        job()


class FakeQuery:
    def __init__(self) -> None:
        self.replies: list[str] = []

    def reply_err(self, data: bytes, *, encoding: zenoh.Encoding) -> None:
        self.replies.append(data.decode())

    def drop(self) -> None:
        self.replies.append("end")


async def test_an_unexpected_error_is_logged_and_answered() -> None:
    async def fail(_question: Question) -> Any:
        raise KeyError("status")

    thread, query = cast("SessionThread", FakeThread()), FakeQuery()
    payloads = Payloads(PayloadEncoding.JSON, lambda: 0.0)
    question = Question(cast("zenoh.Query", query), keys.STATE, "fleet/naze-1/v1/state", payloads, thread)
    with capture_logs() as events:
        await Queries(payloads, thread)._answer(question, fail)
    assert [event["event"] for event in events] == ["daemon.fault", "zenoh.refused"]
    error, end = query.replies
    assert "the daemon failed" in error
    assert end == "end"
