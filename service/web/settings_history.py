# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests about the flight controller's settings: their backups, and restoring one."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from bridge.settings.local_settings import by_parameter
from payloads.mission_data import ACCEPTED, Json
from protocols.param_file import write_param_file
from service.daemon.client import ControlError
from service.daemon.settings_api import SettingsApi
from service.web.access import check_token, route
from service.web.replies import Turns, begun, json_reply, path_number
from service.web.sent_files import MissionWriter, Progress

_LISTED = 50


class SettingsHistory:
    """Answers from SettingsApi. An unauthenticated request never uses the flight controller's line."""

    def __init__(self, api: SettingsApi, writer: MissionWriter, turns: Turns) -> None:
        self._api = api
        self._writer = writer
        self._turns = turns

    def routes(self) -> list[Route]:
        return [
            route("GET", "/api/settings", self._list),
            route("GET", "/api/settings/{number}", self._show),
            route("GET", "/api/settings/{number}/file", self._file),
            route("POST", "/api/settings/{number}/restore", self._restore, check_token),
        ]

    async def _list(self, _request: Request) -> Response:
        return json_reply(await self._api.backups(_LISTED))

    async def _show(self, request: Request) -> Response:
        """The changes in a backup, and the changes that restoring it would make now."""
        async with self._turns.take():
            backup = await self._find(request)
            try:
                plan: Json = await self._api.plan(backup["values"], backup["kind"], is_checked=False)
            except ControlError as error:
                plan = {"refused": str(error)}
            del backup["values"]
            return json_reply(backup | {"plan": plan})

    async def _file(self, request: Request) -> Response:
        backup = await self._find(request)
        name = f"settings-{backup['number']}.param"
        text = write_param_file(by_parameter(backup["values"]), backup["kind"])
        headers = {"Content-Disposition": f'attachment; filename="{name}"'}
        return Response(text, headers=headers, media_type="application/octet-stream")

    async def _restore(self, request: Request) -> Response:
        backup = await self._find(request)
        what = f"settings {backup['number']}"
        return begun(self._writer.begin(what, partial(self._write, backup), "settings"))

    async def _write(self, backup: Json, progress: Progress) -> Json:
        result = await self._api.restore(backup["values"], backup["kind"], "status page", progress)
        return {"ack": ACCEPTED if result["is_saved"] else "", "text": result["text"]}

    async def _find(self, request: Request) -> Json:
        return await self._api.backup(path_number(request, "number"))
