# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies of requests, numbers in them, JSON responses, the turns of long replies, and work that outlasts a request."""

import asyncio
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from http import HTTPStatus

import structlog
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from payloads.mission_data import MOST, Json, to_json
from service.daemon.client import ControlError
from service.machine.helper_socket import HelperError
from storage.store_error import StoreError

#: A page of another site cannot send these types without a preflight request, which only `web.origins` allow.
DATA, JSON = "application/octet-stream", "application/json"
_FAILED = "The daemon failed; see its log."
_log = structlog.get_logger()


async def received_body(request: Request, kind: str = DATA) -> bytes:
    """The body. A slow phone takes seconds to send it."""
    if request.headers.get("content-type", "").partition(";")[0] != kind:
        raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"Send the data as {kind}.")
    try:
        return await request.body()
    except ClientDisconnect as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, "The data was not received completely.") from error


def whole(text: str) -> int:
    """A whole number in a request. Refused if it is none."""
    if not text.isascii() or not text.isdecimal() or len(text) > len(str(MOST)) or int(text) > MOST:
        raise HTTPException(HTTPStatus.NOT_FOUND, f"{text[:20]!r} is not a valid number.")
    return int(text)


def json_reply(value: Json, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return text_reply(to_json(value), status)


def text_reply(json: str, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return Response(json, status, media_type="application/json")


class Turns:
    """Long responses are made one at a time, in a thread.

    That thread holds the interpreter for some milliseconds. So there is a pause after each response, however many
    connections ask for one, so that the loop can serve the links.
    """

    def __init__(self, pause_s: float = 0.05) -> None:
        self._lock = asyncio.Lock()
        self._pause_s = pause_s

    @asynccontextmanager
    async def take(self) -> AsyncIterator[None]:
        async with self._lock:
            yield
            await asyncio.sleep(self._pause_s)


class Worker:
    """One piece of work at a time. The page asks for the result later: it may take longer than a connection lasts.

    `state`: of the current or latest work, None before the first. `busy`: the refusal of a second one. `trouble`: the
    key in the state for an error, a sentence. `path`: of the requests, for the log.
    """

    def __init__(self, path: str, busy: str, trouble: str) -> None:
        self._path, self._busy, self._trouble = path, busy, trouble
        self._task: asyncio.Task[None] | None = None
        self.state: Json | None = None

    def check_idle(self) -> None:
        if self._task is not None and not self._task.done():
            raise HTTPException(HTTPStatus.CONFLICT, self._busy)

    def begin(self, state: Json, work: Callable[[Json], Awaitable[None]]) -> Response:
        """Start the work, which adds to the state. The response has the id by which the page finds it."""
        self.check_idle()
        state = {"id": secrets.token_hex(8), "done": False} | state
        self.state = state
        self._task = asyncio.get_running_loop().create_task(self._run(state, work))
        return json_reply({"id": state["id"]}, HTTPStatus.ACCEPTED)

    async def close(self) -> None:
        """Stop waiting for the result."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self, state: Json, work: Callable[[Json], Awaitable[None]]) -> None:
        try:
            await work(state)
        except (ControlError, HelperError, StoreError, ValueError) as error:
            state[self._trouble] = str(error)
        except Exception:
            state[self._trouble] = _FAILED
            _log.exception("web.failed", path=self._path)
        finally:
            state["done"] = True
