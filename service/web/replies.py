# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies of requests, numbers in them, JSON responses, and the turns of long replies."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from payloads.mission_data import MOST, Json, to_json

#: A page of another site cannot send these types without a preflight request, which only `web.origins` allow.
DATA, JSON = "application/octet-stream", "application/json"


async def received_body(request: Request, kind: str = DATA) -> bytes:
    """The body. A slow phone takes seconds to send it."""
    if request.headers.get("content-type", "").partition(";")[0] != kind:
        raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"Send the data as {kind}.")
    try:
        return await request.body()
    except ClientDisconnect as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, "The data was not received completely.") from error


def path_number(request: Request, name: str) -> int:
    return whole(request.path_params[name])


def whole(text: str) -> int:
    """A whole number in a request. Refused if it is none."""
    if not text.isascii() or not text.isdecimal() or len(text) > len(str(MOST)) or int(text) > MOST:
        raise HTTPException(HTTPStatus.NOT_FOUND, f"{text[:20]!r} is not a valid number.")
    return int(text)


def begun(write_id: str) -> Response:
    return json_reply({"id": write_id}, HTTPStatus.ACCEPTED)


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
