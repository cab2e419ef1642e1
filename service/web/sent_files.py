# SPDX-License-Identifier: GPL-3.0-or-later
"""Files sent by the browser: firmware, and missions, checked by the rules of the current flight controller or written.

The check needs no token, because it changes nothing. It costs the flight controller one request and this machine some
milliseconds, so checks run one at a time with a pause after each.
"""

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from functools import partial
from http import HTTPStatus

import structlog
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
from service.web.replies import Turns, begun, received_body, text_reply
from storage.store_error import StoreError

_PAUSE_S = 0.25
_MAX_NAME = 80
#: An ELF file also has symbols: 300 kB.
_MAX_IMAGE = 1 << 20
_log = structlog.get_logger()

Progress = Callable[[Json], None]


class MissionWriter:
    """One write at a time. `state`: the current or latest one as the page shows it, None before the first."""

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None
        self.state: Json | None = None

    def begin(self, what: str, write: Callable[[Progress], Awaitable[Json]], unit: str = "records") -> str:
        """Start writing. Returns the write's id: the page finds its own result by it. Refused while one runs.

        unit: what `write` counts as its progress.
        """
        self.check_idle()
        state: Json = {"id": secrets.token_hex(8), "what": what, "records": 0, "unit": unit}
        state |= {"done": False, "ok": False, "text": ""}
        self.state = state
        self._task = asyncio.get_running_loop().create_task(self._run(write, state))
        return str(state["id"])

    def check_idle(self) -> None:
        if self._task is not None and not self._task.done():
            raise HTTPException(HTTPStatus.CONFLICT, "Something else is being written: wait until it has finished.")

    async def close(self) -> None:
        """Stop waiting for the result. The daemon itself has ended the transfer."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self, write: Callable[[Progress], Awaitable[Json]], state: Json) -> None:
        def progress(message: Json) -> None:
            state.update(records=message["progress"], text=message.get("text", ""))

        try:
            answer = await write(progress)
            state |= {"ok": answer["ack"] == ACCEPTED, "text": answer["text"]}
        except (ControlError, StoreError, ValueError) as error:
            state["text"] = str(error)
        except Exception:
            state["text"] = "The daemon failed during the write; see its log."
            _log.exception("web.failed", path="/api/write")
        finally:
            state["done"] = True


class SentFiles:
    """The body of a request is the file. The query has its name."""

    def __init__(self, api: DaemonApi, writer: MissionWriter) -> None:
        self._api = api
        self._writer = writer
        self._turns = Turns(_PAUSE_S)

    def routes(self) -> list[Route]:
        return [
            route("POST", "/api/check", self._check, max_body=MAX_FILE),
            route("POST", "/api/write", self._write, check_token, max_body=MAX_FILE),
            route("POST", "/api/firmware", self._flash, check_token, max_body=_MAX_IMAGE),
        ]

    async def check(self, request: Request) -> Json:
        """The mission as the flight controller would hold it."""
        name, body = await _received(request)
        notes: list[str] = []
        async with self._turns.take():
            items = await _parsed(name, body, notes.append)
            with refusing(ControlError, HTTPStatus.SERVICE_UNAVAILABLE):
                verdict = await self._api.check(items)
            checked = await asyncio.to_thread(checked_mission, items, verdict)
            return checked | {"findings": [*notes, *checked["findings"]]}

    async def _check(self, request: Request) -> Response:
        return text_reply(await asyncio.to_thread(to_json, await self.check(request)))

    async def _write(self, request: Request) -> Response:
        name, body = await _received(request)
        items = await _parsed(name, body)
        return begun(self._writer.begin(name, partial(self._api.push, items, f"{name}, from the page")))

    async def _flash(self, request: Request) -> Response:
        """With `battery=1` flash even with a battery connected."""
        name, body = await _received(request)
        with refusing(ImageError, HTTPStatus.UNPROCESSABLE_ENTITY, lambda why: f"{name}: {why}"):
            image = await asyncio.to_thread(parse_image, body, name)
            check_patched(image)
        with_battery = request.query_params.get("battery") == "1"
        return begun(self._writer.begin(name, partial(self._write_firmware, image, with_battery)))

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
