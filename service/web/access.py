# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of every request, and the security headers of every response.

Reading works without a token, so another site's page must not read through the pilot's browser: under its own name
resolved to our address (DNS rebinding), or in a frame. The check of the Host header and the response headers prevent
that. Everything else needs the token in a header, which no other site can make a browser send.
"""

import ipaddress
import re
from collections.abc import Awaitable, Callable, Container, Iterator
from contextlib import contextmanager
from http import HTTPStatus

import structlog
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from payloads.mission_data import to_json
from protocols.mission_file import MissionFileError
from service.daemon.client import ControlError
from service.web.token import TokenError
from storage.os_error import reason
from storage.store_error import StoreError

Handler = Callable[[Request], Awaitable[Response]]


#: With the origin of map tiles.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' {};"
    " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: The connection does not carry a second request (service.web.connection_limit).
_HEADERS = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-resource-policy": b"same-origin",
    b"cross-origin-opener-policy": b"same-origin",
    b"cache-control": b"no-store",
    b"connection": b"close",
}
#: The largest mission file accepted: 500 items of a .plan are about 200 KiB.
MAX_FILE = 256 << 10
#: Domains of local networks, which cannot be registered.
_LOCAL = (".local", ".lan", ".home.arpa", ".internal", ".localhost")
_HOST = re.compile(r"(?P<name>\[[^\]]*\]|[^:\[\]]+)(:[0-9]*)?")
_WRONG_NAME = (
    "Open this page by the Pi's address in numbers or its local name, or add this name to the setting web.hosts."
)
#: Without the file's name: anyone on the network can ask.
_REFUSED = "Wrong token. On the Pi, `sudo naze-bridge token` shows it."
_READ_ONLY = "This page is read-only: the bridge has no token for it. Its log (web.no_token) says why."
_FAILED = "The daemon failed to answer; see its log."
#: The response to an error, whose text is one sentence.
_STATUS = {
    ControlError: HTTPStatus.NOT_FOUND,
    MissionFileError: HTTPStatus.UNPROCESSABLE_ENTITY,
    StoreError: HTTPStatus.SERVICE_UNAVAILABLE,
}
_log = structlog.get_logger()


def is_own_name(host: str, known: Container[str]) -> bool:
    """True if a Host header can only mean this machine: an address, a name without dots, a local or a known one."""
    named = _HOST.fullmatch(host)
    if named is None:
        return False
    name = named["name"].removeprefix("[").removesuffix("]")
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return "." not in name or name.lower().endswith(_LOCAL) or name.lower() in known
    return True


def check_token(request: Request) -> None:
    token = request.app.state.token
    if isinstance(token, TokenError):
        raise HTTPException(HTTPStatus.FORBIDDEN, _READ_ONLY)
    if not token.is_shown_by(request.headers.get("authorization")):
        peer = None if request.client is None else request.client.host
        _log.warning("web.wrong_token", peer=peer, path=request.url.path)
        raise HTTPException(HTTPStatus.UNAUTHORIZED, _REFUSED, {"WWW-Authenticate": "Bearer"})


def route(method: str, path: str, handler: Handler, *checks: Callable[[Request], None], max_body: int = 0) -> Route:
    """A route whose requests are checked first. `checks`: further checks, such as check_token. `max_body`: bytes."""

    async def answer(request: Request) -> Response:
        if not is_own_name(request.headers.get("host", ""), request.app.state.hosts):
            raise HTTPException(HTTPStatus.MISDIRECTED_REQUEST, _WRONG_NAME)
        _check_body(request, max_body)
        for check in checks:
            check(request)
        return await handler(request)

    return Route(path, answer, methods=[method])


def _check_body(request: Request, max_body: int) -> None:
    length = request.headers.get("content-length", "0")
    # h11 has checked that it is a number; int() of a very long one is slow.
    if "transfer-encoding" in request.headers or len(length) > len(str(max_body)) or int(length) > max_body:
        limit = f"at most {max_body >> 10} KiB" if max_body else "no data"
        raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"This request may carry {limit}.")


@contextmanager
def refusing(kind: type[Exception], status: HTTPStatus, sentence: Callable[[str], str] = str) -> Iterator[None]:
    """Respond to such an error with a status, and a sentence made of the reason."""
    try:
        yield
    except kind as error:
        raise HTTPException(status, sentence(reason(error))) from error


async def _refused(_request: Request, error: Exception) -> Response:
    if not isinstance(error, HTTPException):
        error = HTTPException(next(_STATUS[kind] for kind in type(error).__mro__ if kind in _STATUS), str(error))
    return Response(to_json({"error": error.detail}), error.status_code, error.headers, "application/json")


async def _failed(request: Request, error: Exception) -> Response:
    """The response to a request whose handler raised. uvicorn's own log of it is off."""
    _log.error("web.failed", path=request.url.path, why=repr(error), exc_info=error)
    return await _refused(request, HTTPException(HTTPStatus.INTERNAL_SERVER_ERROR, _FAILED))


EXCEPTION_HANDLERS = {Exception: _failed, **dict.fromkeys((HTTPException, *_STATUS), _refused)}


class SafeHeaders:
    """Adds the security headers to every response. `image_origin`: from where the page may also load pictures."""

    def __init__(self, app: ASGIApp, image_origin: str) -> None:
        self._app = app
        self._headers = _HEADERS | {b"content-security-policy": _POLICY.format(image_origin).encode()}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {name for name, _ in message["headers"]}
                message["headers"] += [each for each in self._headers.items() if each[0] not in given]
            await send(message)

        await self._app(scope, receive, send_safely)
