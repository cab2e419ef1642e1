# SPDX-License-Identifier: GPL-3.0-or-later
"""Serves the status page on the daemon's own event loop."""

import asyncio
import logging
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import structlog
from starlette.applications import Starlette
from starlette.middleware.cors import CORSMiddleware
from starlette.requests import Request
from starlette.responses import Response
from uvicorn.config import Config
from uvicorn.server import ServerState

from service.daemon.daemon import Daemon
from service.settings.web import WebSettings
from service.web.access import EXCEPTION_HANDLERS, Handler, SafeHeaders, route
from service.web.api import Api
from service.web.connection_limit import BoundedConnection, ConnectionLimit
from service.web.token import DEFAULT_NAME, Token, TokenError
from storage.os_error import reason

#: An access point's address may appear after the daemon's start: binding is retried.
_RETRY_S = 2.0
#: New connections are accepted a few at a time, so that the links are served in turn.
_BACKLOG = 16
_FOLDER = Path(__file__).parent / "static"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
_log = structlog.get_logger()


class WebServer:
    """The page of one daemon. If it cannot be served, that is logged and retried while the bridge continues.

    Only the protocol of uvicorn is used: its server would handle signals and run the loop itself.
    """

    def __init__(self, daemon: Daemon, settings: WebSettings) -> None:
        self._daemon, self._address = daemon, settings.listen
        self._api = Api(daemon, settings)
        self._config = _config(self._api, settings, _token(daemon, settings))
        self._state = ServerState()
        self._limit = ConnectionLimit()
        self._listening: asyncio.Task[None] | None = None
        self._server: asyncio.Server | None = None

    def start(self) -> None:
        self._listening = asyncio.get_running_loop().create_task(self._listen())

    async def close(self) -> None:
        if self._listening is not None:
            self._listening.cancel()
            with suppress(asyncio.CancelledError):
                await self._listening
        if self._server is not None:
            self._server.close()
        await self._api.close()
        self._limit.close()
        answers = list(self._state.tasks)
        for answer in answers:
            answer.cancel()
        await asyncio.gather(*answers, return_exceptions=True)

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        while self._server is None:
            try:
                self._server = await loop.create_server(
                    lambda: BoundedConnection(self._limit, self._config, self._state),
                    self._address.host,
                    self._address.port,
                    backlog=_BACKLOG,
                )
            except OSError as error:
                why = reason(error)
                if why != self._daemon.page_trouble:
                    _log.error("web.unavailable", address=str(self._address), why=why, what="it is retried")
                self._daemon.page_trouble = why
                await asyncio.sleep(_RETRY_S)
        self._daemon.page_trouble = ""
        _log.info("web.listening", address=str(self._address))


def _config(api: Api, settings: WebSettings, token: Token | TokenError) -> Config:
    routes = [*api.routes(), *(route("GET", *each) for each in _static_files())]
    app = Starlette(routes=routes, exception_handlers=EXCEPTION_HANDLERS)
    app.state.hosts, app.state.token = settings.hosts, token
    # uvicorn would log only the errors of browsers. Ours are logged by `failed`.
    open_app = CORSMiddleware(app, settings.origins, ("GET", "POST"), ("Authorization", "Content-Type"), max_age=600)
    return Config(
        SafeHeaders(open_app if settings.origins else app, settings.map_tiles.origin),
        lifespan="off",
        ws="none",
        proxy_headers=False,
        server_header=False,
        access_log=False,
        log_config=None,
        log_level=logging.CRITICAL + 1,
    )


def _token(daemon: Daemon, settings: WebSettings) -> Token | TokenError:
    state_dir = daemon.settings.state_dir
    path = settings.token_file or (None if state_dir is None else state_dir / DEFAULT_NAME)
    try:
        if path is None:
            raise TokenError("there is no state directory: set token_file under [web]")
        return Token(path)
    except TokenError as error:
        _log.error("web.no_token", why=str(error), what="the page is read-only")
        return error


def _static_files() -> Iterator[tuple[str, Handler]]:
    """Yield path and handler of each of the page's files. They are in memory, so requests do not wait for the card."""
    for file in sorted(_FOLDER.iterdir()):
        if file.suffix in _TYPES:
            yield "/" if file.name == "index.html" else f"/{file.name}", _handler(file)


def _handler(file: Path) -> Handler:
    body, kind = file.read_bytes(), _TYPES[file.suffix]

    async def serve(_request: Request) -> Response:
        return Response(body, media_type=kind)

    return serve
