"""Serves the status page on the daemon's own event loop."""

import asyncio
import logging
from contextlib import suppress
from functools import partial

import structlog
from aiohttp import web

from service.daemon import Daemon
from service.web.access import finish_headers, guarded
from service.web.api import Api
from service.web.door import BoundedConnection, Door
from service.web.settings import WebSettings
from service.web.static_files import static_routes
from service.web.token import DEFAULT_NAME, Token, TokenError

#: An access point's address may come up after the daemon: it is waited for.
_RETRY_S = 5.0
#: Connections that come at once are taken a few at a time; in between the links are served.
_BACKLOG = 16
_log = structlog.get_logger()


class WebServer:
    """The page of one daemon. A page that cannot be served is said in the log and tried again; the bridge goes on."""

    def __init__(self, daemon: Daemon, settings: WebSettings) -> None:
        self._settings = settings
        self._api = Api(daemon, _token(daemon, settings))
        self._task: asyncio.Task[None] | None = None
        self._server: asyncio.Server | None = None
        app = web.Application(middlewares=[guarded])
        app.on_response_prepare.append(finish_headers)
        app.add_routes([*self._api.routes(), *static_routes()])
        # What aiohttp itself would log are the mistakes of browsers; ours are logged by `guarded`.
        silent = logging.Logger("aiohttp", logging.CRITICAL + 1)
        self._runner = web.AppRunner(
            app, handle_signals=False, access_log=None, logger=silent, lingering_time=0, shutdown_timeout=0
        )

    async def start(self) -> None:
        """Begin to listen."""
        await self._runner.setup()
        self._task = asyncio.get_running_loop().create_task(self._listen())

    async def close(self) -> None:
        """Hang up on everybody."""
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task
        if self._server is not None:
            self._server.close()
        await self._api.restoring.close()
        await self._runner.cleanup()

    async def _listen(self) -> None:
        serve = self._runner.server
        assert serve is not None
        factory = partial(BoundedConnection, Door(), serve)
        address = self._settings.listen
        loop = asyncio.get_running_loop()
        said = ""
        while self._server is None:
            try:
                self._server = await loop.create_server(factory, address.host, address.port, backlog=_BACKLOG)
            except OSError as error:
                why = error.strerror or str(error)
                if why != said:
                    _log.error("web.unavailable", address=str(address), why=why, what="it is tried again")
                said = why
                await asyncio.sleep(_RETRY_S)
        _log.info("web.listening", address=str(address))


def _token(daemon: Daemon, settings: WebSettings) -> Token | None:
    state_dir = daemon.settings.state_dir
    path = settings.token_file or (None if state_dir is None else state_dir / DEFAULT_NAME)
    if path is None:
        return None
    try:
        return Token(path)
    except TokenError as error:
        _log.error("web.no_token", why=str(error), what="nothing can be restored from the page")
        return None
