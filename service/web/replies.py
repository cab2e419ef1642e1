# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies of requests, numbers in them, and JSON responses."""

from http import HTTPStatus

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from payloads.mission_data import MOST, Json, to_json

#: A page of another site cannot send this type without a preflight request, which is refused.
_CONTENT_TYPE = "application/octet-stream"


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
    """The response to a write that was started."""
    return json_reply({"id": write_id}, HTTPStatus.ACCEPTED)


def json_reply(value: Json, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return text_reply(to_json(value), status)


def text_reply(json: str, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return Response(json, status, media_type="application/json")
