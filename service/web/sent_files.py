# SPDX-License-Identifier: GPL-3.0-or-later
"""Files sent by the browser: firmware, and missions, checked by the rules of the current flight controller or written.

The check works without a token, because it is a read. It costs the flight controller one request and this machine some
milliseconds, so checks run one at a time with a pause after each.
"""

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from http import HTTPStatus

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from payloads.comparison import checked_mission
from payloads.mission_data import ACCEPTED, MAX_ITEMS, Json, to_json
from protocols.firmware_image import ImageError, check_patched, parse_image
from protocols.mission_file import read_mission_file
from protocols.mission_file.error import no_note
from protocols.mission_item import MissionItem
from service.daemon.api import DaemonApi
from service.daemon.client import ControlError
from service.web.access import MAX_FILE, check_token, refusing, route
from service.web.replies import Turns, Worker, received_body, text_reply

_PAUSE_S = 0.25
_MAX_NAME = 80
#: An ELF file also has symbols: 300 kB.
_MAX_IMAGE = 1 << 20

Progress = Callable[[Json], None]


class MissionWriter(Worker):
    """Writes to the flight controller. A stop of the daemon itself ends the transfer."""

    def __init__(self) -> None:
        super().__init__("/api/write", "Something else is being written: wait until it has finished.", "text")

    def write(self, what: str, write: Callable[[Progress], Awaitable[Json]], unit: str = "records") -> Response:
        """Begin to write. `unit`: what `write` counts as its progress."""

        async def work(state: Json) -> None:
            def progress(message: Json) -> None:
                state.update(records=message["progress"], text=message.get("text", ""))

            answer = await write(progress)
            state |= {"ok": answer["ack"] == ACCEPTED, "text": answer["text"]}

        return self.begin({"what": what, "records": 0, "unit": unit, "ok": False, "text": ""}, work)


class SentFiles:
    """The body of a request is the file. The query has its name."""

    def __init__(self, api: DaemonApi, writer: MissionWriter) -> None:
        self._api = api
        self._writer = writer
        self._turns = Turns(_PAUSE_S)

    def routes(self) -> list[Route]:
        return [
            route("POST", "/api/check", self.check, max_body=MAX_FILE),
            route("POST", "/api/write", self._write, check_token, max_body=MAX_FILE),
            route("POST", "/api/firmware", self._flash, check_token, max_body=_MAX_IMAGE),
        ]

    async def check(self, request: Request) -> Response:
        """The mission as the flight controller would hold it."""
        name, body = await _received(request)
        notes: list[str] = []
        async with self._turns.take():
            items = await _parsed(name, body, notes.append)
            with refusing(ControlError, HTTPStatus.SERVICE_UNAVAILABLE):
                verdict = await self._api.check(items)
            checked = await asyncio.to_thread(checked_mission, items, verdict)
            checked["findings"] = [*notes, *checked["findings"]]
            return text_reply(await asyncio.to_thread(to_json, checked))

    async def _write(self, request: Request) -> Response:
        name, body = await _received(request)
        items = await _parsed(name, body)
        return self._writer.write(name, partial(self._api.push, items, f"{name}, from the page"))

    async def _flash(self, request: Request) -> Response:
        """With `battery=1` flash even with a battery connected."""
        name, body = await _received(request)
        with refusing(ImageError, HTTPStatus.UNPROCESSABLE_ENTITY, lambda why: f"{name}: {why}"):
            image = await asyncio.to_thread(parse_image, body, name)
            check_patched(image)
        with_battery = request.query_params.get("battery") == "1"
        return self._writer.write(name, partial(self._write_firmware, image, with_battery))

    async def _write_firmware(self, image: bytes, with_battery: bool, progress: Progress) -> Json:
        def show(message: Json) -> None:
            step, done, total = (message["progress"][key] for key in ("step", "done", "total"))
            text = f"{step.capitalize()}: {done} of {total} pages …" if total else step
            progress({"progress": done, "text": text})

        result = await self._api.firmware.flash(image, show, with_battery=with_battery)
        return {"ack": ACCEPTED, "text": result["text"]}


async def _received(request: Request) -> tuple[str, bytes]:
    name = request.query_params.get("name", "")[-_MAX_NAME:] or "mission file"
    return name, await received_body(request)


async def _parsed(name: str, body: bytes, note: Callable[[str], None] = no_note) -> list[MissionItem]:
    items = await asyncio.to_thread(read_mission_file, body, name, note)
    if len(items) > MAX_ITEMS:
        raise HTTPException(
            HTTPStatus.UNPROCESSABLE_ENTITY, f"{name} has {len(items)} items; the limit is {MAX_ITEMS}."
        )
    if not items:
        raise HTTPException(HTTPStatus.UNPROCESSABLE_ENTITY, f"{name} has no items: choose another file.")
    return items
