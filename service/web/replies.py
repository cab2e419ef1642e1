# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies of requests, numbers in them, JSON responses, and a cache of long ones."""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from http import HTTPStatus

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from payloads.mission_data import MOST, Json, to_json

#: A page of another site cannot send this type without a preflight request, which is refused.
_CONTENT_TYPE = "application/octet-stream"
#: The last upload, which each open page shows, and a few that are being looked at.
_KEPT = 8
_PAUSE_S = 0.05


async def received_body(request: Request) -> bytes:
    """The body. A slow phone takes seconds to send it."""
    if request.headers.get("content-type") != _CONTENT_TYPE:
        raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"Send the data as {_CONTENT_TYPE}.")
    try:
        return await request.body()
    except ClientDisconnect as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, "The data was not received completely.") from error


def path_number(request: Request, name: str) -> int:
    return whole(request.path_params[name])


def whole(text: str) -> int:
    """A whole number in a request; refused if it is none."""
    if not text.isascii() or not text.isdecimal() or len(text) > len(str(MOST)) or int(text) > MOST:
        raise HTTPException(HTTPStatus.NOT_FOUND, f"{text[:20]!r} is not a valid number.")
    return int(text)


def begun(write_id: str) -> Response:
    return json_reply({"id": write_id}, HTTPStatus.ACCEPTED)


def json_reply(value: Json, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return text_reply(to_json(value), status)


def text_reply(json: str, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return Response(json, status, media_type="application/json")


class ResponseCache:
    """Caches responses that are final. Long ones are made in a thread, one at a time.

    That thread holds the interpreter for some milliseconds. So there is a pause after each response, however many
    connections ask for one, so that the loop can serve the links.
    """

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._kept: OrderedDict[str, str] = OrderedDict()

    async def get(self, question: str, make: Callable[[], Awaitable[tuple[str, bool]]]) -> str:
        """The response; `make` returns it, and True if it is final."""
        async with self._turn:
            answer = self._kept.get(question)
            if answer is None:
                answer, is_final = await make()
                if is_final:
                    self._kept[question] = answer
                    while len(self._kept) > _KEPT:
                        self._kept.popitem(last=False)
                await asyncio.sleep(_PAUSE_S)
        return answer
