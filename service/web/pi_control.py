# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests about the Pi itself: carried out by the root helper (service.cli.helper).

All need the token, and a browser on the Pi's own network. Every change is refused while the craft is armed, and while
the page writes something to the flight controller or new firmware is flashed.
"""

import asyncio
import ipaddress
import json
import os
from collections.abc import Iterator
from http import HTTPStatus
from tempfile import TemporaryFile
from typing import IO

import structlog
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from payloads.mission_data import Json
from service.daemon.daemon import Daemon
from service.machine.helper_socket import MAX_PACKAGE, HelperError, ask_helper, unit_of
from service.machine.log_setup import recent_lines
from service.web.access import MAX_FILE, check_token, refusing, route
from service.web.replies import JSON, Worker, json_reply, received_body, whole
from service.web.sent_files import MissionWriter

_MAX_REQUEST = 64 << 10
_PIECE = 1 << 16
_ELSEWHERE = "The Pi can be changed only from its own network: its hotspot, or the network that it has joined."
_NOT_NEXT = "This part does not follow the previous part, or the package is too long: begin again."
_log = structlog.get_logger()


def is_local(peer: str) -> bool:
    """True for an address of a private network or of this machine."""
    address = ipaddress.ip_address(peer.partition("%")[0])
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address.is_private or address.is_link_local or address.is_loopback


def check_local(request: Request) -> None:
    if request.client is None or not is_local(request.client.host):
        raise HTTPException(HTTPStatus.FORBIDDEN, _ELSEWHERE)


class PiControl:
    """One request at a time."""

    def __init__(self, daemon: Daemon, writer: MissionWriter) -> None:
        self._daemon = daemon
        self._writer = writer
        self._worker = Worker("/api/pi", "Another change is being made: wait until it has finished.", "error")
        self._package: IO[bytes] | None = None

    def routes(self) -> list[Route]:
        checks = check_local, check_token
        return [
            route("GET", "/api/pi", self._show, *checks),
            route("POST", "/api/pi", self._begin, *checks, max_body=_MAX_REQUEST),
            route("POST", "/api/pi/package", self._keep, *checks, max_body=MAX_FILE),
            route("GET", "/api/log", self._read_log, *checks),
        ]

    async def close(self) -> None:
        await self._worker.close()
        self._drop_package()

    async def _show(self, _request: Request) -> Response:
        """The request begun last, and the reply."""
        return json_reply(self._worker.state or {"id": None, "done": True})

    async def _begin(self, request: Request) -> Response:
        """The body is a request to the helper."""
        try:
            asked = json.loads(await received_body(request, JSON))
            action, unit = asked["action"], unit_of(asked["action"])
        except (ValueError, TypeError, KeyError, RecursionError):
            unit = None
        if unit is None:
            raise HTTPException(HTTPStatus.UNPROCESSABLE_ENTITY, "Send a request with an action as JSON.")
        if unit != "look":
            self._check_changeable()
            self._writer.check_idle()
        peer = None if request.client is None else request.client.host
        _log.info("web.pi_request", action=action, peer=peer)

        async def work(state: Json) -> None:
            state["reply"] = await (self._install() if action == "install" else ask_helper(asked))

        return self._worker.begin({"action": action}, work)

    async def _install(self) -> Json:
        package, self._package = self._package, None
        if package is None:
            raise HelperError("Send the package first.")
        with package:
            size = package.seek(0, os.SEEK_END)
            return await ask_helper({"action": "install", "size": size}, _pieces(package))

    async def _keep(self, request: Request) -> Response:
        """The body is a piece of a package, from byte `start` on: kept for the request "install"."""
        self._check_changeable()
        start, piece = whole(request.query_params.get("start", "0")), await received_body(request)
        with (
            refusing(OSError, HTTPStatus.SERVICE_UNAVAILABLE, lambda why: f"It cannot be stored: {why}."),
            refusing(FileNotFoundError, HTTPStatus.CONFLICT, lambda _: _NOT_NEXT),
        ):
            return json_reply({"size": await asyncio.to_thread(self._append, start, piece)})

    async def _read_log(self, request: Request) -> Response:
        """The daemon's log lines after the first `after`."""
        count, lines = recent_lines(whole(request.query_params.get("after", "0")))
        return json_reply({"count": count, "lines": [line._asdict() for line in lines]})

    def _append(self, start: int, piece: bytes) -> int:
        """Append a piece that follows those before. FileNotFoundError if it does not. Returns the size so far."""
        if start == 0:
            self._drop_package()
            # Without a name: the kernel removes it with the daemon.
            self._package = TemporaryFile(dir=self._daemon.settings.state_dir)  # noqa: SIM115  # closed by _drop_package
        file = self._package
        if file is None or start != file.seek(0, os.SEEK_END) or start + len(piece) > MAX_PACKAGE:
            raise FileNotFoundError
        file.write(piece)
        return start + len(piece)

    def _drop_package(self) -> None:
        if self._package is not None:
            self._package.close()
            self._package = None

    def _check_changeable(self) -> None:
        # A craft that was lost while armed may still fly.
        if self._daemon.report().last_heard.armed:
            raise HTTPException(HTTPStatus.CONFLICT, "The craft is armed: disarm it first.")
        if self._daemon.fc.is_lent:
            raise HTTPException(HTTPStatus.CONFLICT, "New firmware is being flashed: wait until it has finished.")


def _pieces(file: IO[bytes]) -> Iterator[bytes]:
    file.seek(0)
    while piece := file.read(_PIECE):
        yield piece
