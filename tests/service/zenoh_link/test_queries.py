# SPDX-License-Identifier: GPL-3.0-or-later
"""Every query gets a last reply, also if the daemon fails or others flood it."""

import asyncio
from typing import Any, cast

import zenoh
from structlog.testing import capture_logs

from payloads import keys
from payloads.payload import Payloads
from service.settings.zenoh import ZenohSettings
from service.settings.zenoh_config import make_config
from service.zenoh_link.queries import Queries, Question
from service.zenoh_link.session import Job, JobKind, SessionThread
from tests.support.programs import TIMEOUT_S, until
from tests.support.zenoh_bench import ask, body, endpoint, key, session


class FakeThread:
    """Runs the replies at once."""

    def submit(self, job: Job, kind: JobKind) -> None:
        assert kind is JobKind.REPLY
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
    payloads = Payloads(lambda: 0.0)
    question = Question(cast("zenoh.Query", query), keys.STATE, "fleet/naze-1/v1/state", payloads, thread)
    with capture_logs() as events:
        await Queries(payloads, thread)._answer(question, fail)
    assert [event["event"] for event in events] == ["daemon.fault", "zenoh.refused"]
    error, end = query.replies
    assert "the daemon failed" in error
    assert end == "end"


FLOOD = 40


async def test_a_flood_of_guest_queries_does_not_block_commands() -> None:
    where = endpoint()
    thread = SessionThread(make_config(ZenohSettings(listen=(where,))), lambda opened: declare(opened))
    queries = Queries(Payloads(lambda: 0.0), thread)

    async def never(_question: Question) -> Any:
        await asyncio.Event().wait()

    async def at_once(_question: Question) -> Any:
        return {"result": "done"}

    def declare(opened: zenoh.Session) -> None:
        for each, answerer in ((keys.MISSION_LIST, never), (keys.STATE, never), (keys.UPLOAD, at_once)):
            queries.declare(opened, each, key(each.suffix.removeprefix("v1/")), answerer)

    def guest_and_pilot() -> list[Any]:
        refused: list[Any] = []

        def count(reply: zenoh.Reply) -> None:
            refused.append(body(reply.err) if reply.err else None)

        with session(connect=where) as guest, session(connect=where) as pilot:
            for suffix in ("mission/list", "state"):
                before = len(refused)
                for _ in range(FLOOD):
                    guest.get(key(suffix), zenoh.handlers.Callback(count), timeout=TIMEOUT_S)
                # Some are refused: the others hold all places.
                until(lambda before=before: len(refused) > before, f"a refusal of {suffix}")  # type: ignore[misc]
            answers = [ask(pilot, keys.UPLOAD.suffix) for _ in range(3)]
        assert all("try again" in each["error"] for each in refused)
        return answers

    thread.start()
    try:
        assert await asyncio.to_thread(guest_and_pilot) == [[{"result": "done"}]] * 3
    finally:
        await queries.close()
        thread.close()
