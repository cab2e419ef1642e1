# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's request for new firmware.

POST /api/firmware?name=NAME&battery=1   the body is an image: flash it; its progress is in the state (token)
"""

import asyncio
from functools import partial
from http import HTTPStatus

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from payloads.mission_data import ACCEPTED, Json
from protocols.firmware_image import ImageError, check_patched, parse_image
from service.daemon.firmware_api import FirmwareApi
from service.web.access import check_token, guarded
from service.web.mission_files import MissionWriter, Progress, received
from service.web.replies import begun
from service.web.token import Token, TokenError

#: An ELF file has symbols, too: 300 kB.
_MAX_IMAGE = 1 << 20


class FirmwareUpload:
    """Flashes through FirmwareApi."""

    def __init__(self, api: FirmwareApi, writer: MissionWriter, token: Token | TokenError) -> None:
        self._api = api
        self._writer = writer
        self._token = token

    def routes(self) -> list[Route]:
        """The table above."""
        return [Route("/api/firmware", guarded(self._flash, _MAX_IMAGE), methods=["POST"])]

    async def _flash(self, request: Request) -> Response:
        check_token(request, self._token)
        name, body = await received(request)
        try:
            image = (await asyncio.to_thread(parse_image, body, name)).program
            check_patched(image)
        except ImageError as error:
            raise HTTPException(HTTPStatus.UNPROCESSABLE_ENTITY, f"{name}: {error}") from error
        with_battery = request.query_params.get("battery") == "1"
        return begun(self._writer.begin(name, partial(self._write, image, with_battery)))

    async def _write(self, image: bytes, with_battery: bool, progress: Progress) -> Json:
        def show(message: Json) -> None:
            step, done, total = (message["progress"][key] for key in ("step", "done", "total"))
            text = f"{step.capitalize()}: {done} of {total} pages …" if total else step
            progress({"progress": done, "text": text})

        result = await self._api.flash(image, show, with_battery=with_battery)
        return {"ack": ACCEPTED, "text": result["text"]}
