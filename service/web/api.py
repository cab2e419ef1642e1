# SPDX-License-Identifier: GPL-3.0-or-later
"""What the page asks for: JSON over GET; and the one thing that it does, a restore.

GET  /api/state                          how everything is now; asked once a second by an open page
GET  /api/held                           the list that the flight controller holds
GET  /api/missions                       the missions that came in lately, newest first
GET  /api/missions/N                     one of them, as sent beside as stored
GET  /api/missions/N/difference/M        two of them as sent
POST /api/missions/N/restore             write it again; needs the token; its progress is in the state
GET  /metrics                            for Prometheus
"""

import asyncio
from collections.abc import Awaitable
from dataclasses import asdict
from http import HTTPStatus

from starlette.requests import Request
from starlette.responses import Response

from bridge.missions.mission_service import HeldMission
from bridge.model.mission_log import Outcome
from protocols.mission_item import MissionItem
from service.api import MOST, ControlError, MissionJobs
from service.daemon import Daemon
from service.metrics import CONTENT_TYPE, Metrics
from service.mission_data import Json, mission_items, to_json
from service.version import version
from service.web.access import Handler, Refused, check_token
from service.web.comparison import difference, shown, stored_mission
from service.web.kept_answers import KeptAnswers
from service.web.restoring import Restoring
from service.web.token import Token
from storage.store_error import StoreError

_LISTED = 50


class Api:
    """Answers with what MissionJobs and the bridge's report tell. `token` None: nothing can be changed."""

    def __init__(self, daemon: Daemon, token: Token | None) -> None:
        self._daemon = daemon
        self._jobs = MissionJobs(daemon)
        self._token = token
        self._metrics = Metrics(daemon)
        self._kept = KeptAnswers()
        self._held_text: tuple[HeldMission, str] | None = None
        self.restoring = Restoring(self._jobs)

    def handlers(self) -> dict[tuple[str, str], Handler]:
        """Return the table above: method, path, and who answers."""
        return {
            ("GET", "/api/state"): self._state,
            ("GET", "/api/held"): self._held,
            ("GET", "/api/missions"): self._missions,
            ("GET", "/api/missions/{number}"): self._mission,
            ("GET", "/api/missions/{number}/difference/{other}"): self._difference,
            ("POST", "/api/missions/{number}/restore"): self._restore,
            ("GET", "/metrics"): self._render_metrics,
        }

    async def _state(self, _request: Request) -> Response:
        daemon = self._daemon
        try:
            listed = (await self._jobs.list_missions(1))["missions"]
            newest = {key: listed[0][key] for key in ("number", "outcome")} if listed else None
            store = daemon.store_trouble
        except StoreError as error:
            newest, store = None, str(error)
        return _json(
            {
                "version": version(),
                **asdict(daemon.bridge.report.whole()),
                "traffic": {name: asdict(traffic) for name, traffic in daemon.traffic.items()},
                "port": {"address": str(daemon.settings.fc), "trouble": daemon.fc_trouble},
                "refused": [f"{count} x {why} ({link})" for (link, why), count in daemon.bridge.guard.refused.items()],
                "recording": daemon.recording,
                "newest_mission": newest,
                "store_trouble": store,
                "restore": self.restoring.state,
            }
        )

    async def _held(self, _request: Request) -> Response:
        """Tell what was last read: a stranger who asks keeps the flight controller's line free."""
        held = self._daemon.bridge.missions.held
        if held is None:
            return _json({"count": None, "checksum": None, "items": []})
        if self._held_text is None or self._held_text[0] is not held:
            self._held_text = held, _held_text(held)
        return _text(self._held_text[1])

    async def _missions(self, _request: Request) -> Response:
        return _json(await _told(self._jobs.list_missions(_LISTED)))

    async def _mission(self, request: Request) -> Response:
        number = _number(request, "number")

        async def make() -> tuple[str, bool]:
            mission = await self._find(number)
            text = await asyncio.to_thread(lambda: to_json(stored_mission(mission)))
            return text, mission["outcome"] != Outcome.PENDING.value

        return _text(await self._kept.get(str(number), make))

    async def _difference(self, request: Request) -> Response:
        number, other = _number(request, "number"), _number(request, "other")

        async def make() -> tuple[str, bool]:
            first, second = await self._find(number), await self._find(other)
            return await asyncio.to_thread(lambda: to_json({"rows": difference(_sent(first), _sent(second))})), True

        return _text(await self._kept.get(f"{number} {other}", make))

    async def _restore(self, request: Request) -> Response:
        check_token(request, self._token)
        self.restoring.begin(_number(request, "number"))
        return _json({"begun": True}, HTTPStatus.ACCEPTED)

    async def _render_metrics(self, _request: Request) -> Response:
        return Response(self._metrics.render(), media_type=CONTENT_TYPE)

    async def _find(self, number: int) -> Json:
        return await _told(self._jobs.show_mission(number))


def _number(request: Request, name: str) -> int:
    text = request.path_params[name]
    if not text.isascii() or not text.isdecimal() or len(text) > len(str(MOST)) or int(text) > MOST:
        raise Refused(HTTPStatus.NOT_FOUND, f"{text[:20]!r} is no mission's number.")
    return int(text)


def _sent(mission: Json) -> list[MissionItem]:
    return mission_items(mission["received"]["items"])


async def _told(asked: Awaitable[Json]) -> Json:
    """Wait for the store; what it cannot tell becomes a refusal."""
    try:
        return await asked
    except ControlError as error:
        raise Refused(HTTPStatus.NOT_FOUND, str(error)) from error
    except StoreError as error:
        raise Refused(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from error


def _held_text(held: HeldMission) -> str:
    identity, items = held.identity, [shown(item) for item in held.items]
    return to_json({"count": identity.count, "checksum": f"{identity.checksum:08x}", "items": items})


def _json(value: Json, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return _text(to_json(value), status)


def _text(json: str, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return Response(json, status, media_type="application/json")
