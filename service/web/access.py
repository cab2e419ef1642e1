"""What every request must be like, and what every answer says to the browser.

Reading needs no token, so another site's page must not read through the pilot's browser: by its own name, turned to our
address (DNS rebinding), or in a frame. Hence the check of the name asked for, and the headers. What is not reading
needs the token in a header, which no other site can make a browser send.
"""

import ipaddress
import re
from collections.abc import Awaitable, Callable
from http import HTTPStatus

import structlog
from aiohttp import web

from service.web.token import Token

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self';"
    " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
#: Names below these are given in a local network; nobody can buy one.
_LOCAL = (".local", ".lan", ".home.arpa", ".internal", ".localhost")
_HOST = re.compile(r"(?P<name>\[[^\]]*\]|[^:\[\]]+)(:[0-9]*)?")
_WRONG_NAME = "Open this page by the Pi's address in numbers, or by its local name."
_NO_BODY = "This takes no body."
_log = structlog.get_logger()


class Refused(Exception):
    """A request that is not done: an HTTP status, and one sentence."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


def is_local_name(host: str) -> bool:
    """Tell whether a Host header can only mean this machine: an address, a name without dots, or a local one."""
    named = _HOST.fullmatch(host)
    if named is None:
        return False
    name = named["name"].removeprefix("[").removesuffix("]")
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return "." not in name or name.lower().endswith(_LOCAL)
    return True


def check_token(request: web.Request, token: Token | None) -> None:
    """Refuse who does not show the token."""
    if token is None:
        raise Refused(HTTPStatus.FORBIDDEN, "There is no token, so nothing can be changed from here; the log says why.")
    if not token.is_shown_by(request.headers.get("Authorization")):
        _log.warning("web.wrong_token", peer=request.remote, path=request.path)
        raise Refused(HTTPStatus.FORBIDDEN, f"This needs the token that stands in {token.path} on the Pi.")


@web.middleware
async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Let a request through to its handler, and make an answer of whatever comes of it."""
    try:
        if not is_local_name(request.host):
            raise Refused(HTTPStatus.MISDIRECTED_REQUEST, _WRONG_NAME)
        if request.can_read_body:
            raise Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, _NO_BODY)
        return await handler(request)
    except Refused as refusal:
        return web.json_response({"error": str(refusal)}, status=refusal.status)
    except web.HTTPException as answer:
        return web.json_response({"error": answer.reason}, status=answer.status, headers=_allowed(answer))
    except Exception as error:
        _log.error("web.failed", path=request.path, why=repr(error), exc_info=error)
        text = "The daemon has failed to answer; its log says more."
        return web.json_response({"error": text}, status=HTTPStatus.INTERNAL_SERVER_ERROR)


async def finish_headers(_request: web.Request, response: web.StreamResponse) -> None:
    """Tell the browser what it must not do; the connection carries no second request (service.web.door)."""
    for name, value in _HEADERS.items():
        response.headers.setdefault(name, value)
    response.headers.popall("Server", None)
    response.force_close()


def _allowed(answer: web.HTTPException) -> dict[str, str]:
    return {"Allow": answer.headers["Allow"]} if "Allow" in answer.headers else {}
