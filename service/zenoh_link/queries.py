# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries: received on zenoh's threads, handled on the event loop, answered on the session's thread."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from functools import partial

import structlog
import zenoh

from payloads.keys import UPLOAD, ZenohKey
from payloads.mission_data import Json, to_json
from payloads.payload import Payloads, attachment_of, encoding_of
from service.daemon.client import ControlError
from service.machine.threads import post
from service.zenoh_link.session import JobKind, SessionThread
from storage.os_error import reason
from storage.store_error import StoreError

#: Commands that are answered at once, and as many other queries; more are refused. A command may hold a mission file.
#: Guests send the others: a flood of theirs must not refuse a command.
_MAX_AT_ONCE = 16
_STOPPED = "the daemon stopped before it could reply; after a restart mission/current shows what is on board"

_log = structlog.get_logger()


class QueryRefused(Exception):
    """The query gets an error, in one sentence. `result`: further data for the client."""

    def __init__(self, text: str, result: Json | None = None) -> None:
        super().__init__(text)
        self.result = result


class Question:
    """One query waiting for the reply. `name`: the full key."""

    def __init__(self, query: zenoh.Query, key: ZenohKey, name: str, payloads: Payloads, thread: SessionThread) -> None:
        self._query = query
        self._key = key
        self._payloads = payloads
        self._thread = thread
        self._reply_kind = JobKind.COMMAND_REPLY if key.is_command else JobKind.REPLY
        self.name = name

    @property
    def size(self) -> int:
        payload = self._query.payload
        return 0 if payload is None else len(payload)

    def payload(self) -> bytes:
        payload = self._query.payload
        return b"" if payload is None else payload.to_bytes()

    def send(self, body: Json) -> None:
        """Send one reply; more may follow."""
        data, encoding = self._payloads.reply(self._key, body), encoding_of(self._key)
        attachment = attachment_of(self._key)

        def reply() -> None:
            timestamp = self._thread.timestamp()
            self._query.reply(self.name, data, encoding=encoding, timestamp=timestamp, attachment=attachment)

        self._thread.submit(reply, self._reply_kind)

    def refuse(self, error: QueryRefused) -> None:
        body = {"error": str(error)} | ({} if error.result is None else {"result": error.result})
        answer = partial(self._query.reply_err, to_json(body).encode(), encoding=encoding_of(UPLOAD))
        self._thread.submit(answer, self._reply_kind)

    def end(self) -> None:
        """Mark the last reply as sent."""
        self._thread.submit(self._query.drop, self._reply_kind)


#: Returns the last reply's body; QueryRefused, ControlError, StoreError, OSError and ValueError become an error reply.
Answerer = Callable[[Question], Awaitable[Json]]


class Queries:
    """Starts a task per query, up to a maximum for each kind of query."""

    def __init__(self, payloads: Payloads, thread: SessionThread) -> None:
        self._payloads = payloads
        self._thread = thread
        self._loop = asyncio.get_running_loop()
        self._tasks: set[asyncio.Task[None]] = set()
        self._places = {is_command: threading.Semaphore(_MAX_AT_ONCE) for is_command in (False, True)}

    def declare(self, session: zenoh.Session, key: ZenohKey, name: str, answerer: Answerer) -> None:
        """Declare the queryable of one key. `name`: the full key. Called on the session's thread."""
        places = self._places[key.is_command]

        def asked(query: zenoh.Query) -> None:
            question = Question(query, key, name, self._payloads, self._thread)
            if key.is_command and str(query.key_expr) != name:
                refusal = "a wildcard does not send commands: name one vehicle and one command"
            elif not places.acquire(blocking=False):
                refusal = f"{_MAX_AT_ONCE} queries of this kind are being answered already: try again"
            else:
                post(self._loop, self._begin, question, answerer, places)
                return
            question.refuse(QueryRefused(refusal))
            question.end()

        session.declare_queryable(name, zenoh.handlers.Callback(asked, indirect=False))

    async def close(self) -> None:
        """Fail the queries of waiting clients."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _begin(self, question: Question, answerer: Answerer, places: threading.Semaphore) -> None:
        task = self._loop.create_task(self._answer(question, answerer))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        task.add_done_callback(lambda _: places.release())

    async def _answer(self, question: Question, answerer: Answerer) -> None:
        try:
            question.send(await answerer(question))
        except QueryRefused as error:
            self._refuse(question, error)
        except (ControlError, StoreError, OSError, ValueError) as error:
            self._refuse(question, QueryRefused(reason(error)))
        except asyncio.CancelledError:
            self._refuse(question, QueryRefused(_STOPPED))
        except Exception as error:
            _log.exception("daemon.fault", what=f"the query {question.name}")
            self._refuse(question, QueryRefused(f"the daemon failed ({error!r}); see its log"))
        question.end()

    def _refuse(self, question: Question, error: QueryRefused) -> None:
        _log.info("zenoh.refused", key=question.name, why=str(error))
        question.refuse(error)
