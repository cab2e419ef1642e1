# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's request for new firmware."""

import asyncio
from functools import partial
from http import HTTPStatus

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from payloads.mission_data import ACCEPTED, Json
from protocols.firmware_image import ImageError, check_patched, parse_image
from service.daemon.firmware_api import FirmwareApi
from service.web.access import check_token, refusing, route
from service.web.mission_files import MissionWriter, Progress, received
from service.web.replies import begun

#: An ELF file has symbols, too: 300 kB.
_MAX_IMAGE = 1 << 20


class FirmwareUpload:
    """Flashes through FirmwareApi."""

    def __init__(self, api: FirmwareApi, writer: MissionWriter) -> None:
        self._api = api
        self._writer = writer

    def routes(self) -> list[Route]:
        return [route("POST", "/api/firmware", self._flash, check_token, max_body=_MAX_IMAGE)]

    async def _flash(self, request: Request) -> Response:
        """The body is an image, `name` its file's name; with `battery=1` flash also with a battery connected."""
        name, body = await received(request)
        with refusing(ImageError, HTTPStatus.UNPROCESSABLE_ENTITY, lambda why: f"{name}: {why}"):
            image = (await asyncio.to_thread(parse_image, body, name)).program
            check_patched(image)
        with_battery = request.query_params.get("battery") == "1"
        return begun(self._writer.begin(name, partial(self._write, image, with_battery)))

    async def _write(self, image: bytes, with_battery: bool, progress: Progress) -> Json:
        def show(message: Json) -> None:
            step, done, total = (message["progress"][key] for key in ("step", "done", "total"))
            text = f"{step.capitalize()}: {done} of {total} pages …" if total else step
            progress({"progress": done, "text": text})

        result = await self._api.flash(image, show, with_battery=with_battery)
        return {"ack": ACCEPTED, "text": result["text"]}
