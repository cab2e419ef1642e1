# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests: JSON over GET; writing a mission and fetching logs need the token.

GET  /api/state                          the current state, requested once a second by an open page
GET  /api/held                           the mission that the flight controller holds
GET  /api/link                           the serial line over the last minutes
GET  /api/track?first=N                  the track of this flight or the last one, from place N on
GET  /api/connect                        where ground stations and other browsers connect
GET  /connect.svg                        the page's address as a QR code
GET  /api/missions                       the latest missions received, newest first
GET  /api/missions/N                     one of them, as sent and as stored
GET  /api/missions/N/difference/M        two of them as sent
POST /api/missions/N/restore             write it again; its progress is in the state (token)
POST /api/check?name=NAME                the body is a mission file: the mission as it would be stored
POST /api/write?name=NAME                the body is a mission file: write it (token)
GET  /api/logs                           the telemetry logs (token)
GET  /api/logs/NAME?start=N              one piece of a log (token)
GET  /api/settings...                    see service.web.settings_history
POST /api/firmware?name=NAME             see service.web.firmware_upload
     /api/pi..., /api/log                see service.web.pi_control
     /api/map...                         see service.web.map_tiles
GET  /metrics                            for Prometheus
"""

import asyncio
from collections.abc import Awaitable
from dataclasses import asdict
from functools import partial
from http import HTTPStatus
from typing import TypeVar

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from bridge.missions.mission_service import HeldMission
from bridge.model.mission_log import Outcome
from payloads.comparison import difference, shown, stored_mission
from payloads.mission_data import Json, mission_items, to_json
from protocols.mission_item import MissionItem
from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon
from service.daemon.telemetry_logs import TelemetryLogs
from service.machine.host import Host
from service.machine.package import version
from service.recording.tlog_recorder import TLOG_FOLDER
from service.settings.web import WebSettings
from service.web.access import MAX_FILE, check_token, guarded
from service.web.connect_help import connect_help, page_urls, qr_code
from service.web.firmware_upload import FirmwareUpload
from service.web.flown_track import FlownTrack
from service.web.link_history import LinkHistory
from service.web.map_tiles import MapTiles
from service.web.metrics import CONTENT_TYPE, Metrics
from service.web.mission_files import MissionFiles, MissionWriter
from service.web.pi_control import PiControl
from service.web.replies import answered, begun, json_reply, path_number, text_reply, whole
from service.web.response_cache import ResponseCache
from service.web.settings_history import SettingsHistory
from service.web.token import Token, TokenError
from storage.os_error import reason
from storage.store_error import StoreError

_LISTED = 50
T = TypeVar("T")


class Api:
    """Answers from DaemonApi and the bridge's report. `token` None: everything that needs it is refused."""

    def __init__(self, daemon: Daemon, settings: WebSettings, token: Token | TokenError) -> None:
        self._daemon = daemon
        self._listen = settings.listen
        self._api = DaemonApi(daemon)
        self._token = token
        self._metrics = Metrics(daemon)
        self._cache = ResponseCache()
        self._held_text: tuple[HeldMission, str] | None = None
        self._writer = MissionWriter()
        self._files = MissionFiles(self._api, self._writer)
        self._settings = SettingsHistory(self._api.settings, self._writer, self._cache, token)
        self._firmware = FirmwareUpload(self._api.firmware, self._writer, token)
        self._pi = PiControl(daemon, self._writer, token)
        self._map = MapTiles(daemon, settings, token)
        self._history = LinkHistory(daemon)
        self._track = FlownTrack(daemon)
        state_dir = daemon.settings.state_dir
        self._logs = TelemetryLogs(None if state_dir is None else state_dir / TLOG_FOLDER)
        self._host = Host()

    def start(self) -> None:
        self._history.start()
        self._track.start()

    async def close(self) -> None:
        self._history.close()
        self._track.close()
        await self._writer.close()
        await self._pi.close()
        await self._map.close()
        self._logs.close()

    def image_origin(self) -> str:
        """See access.content_policy."""
        return self._map.image_origin

    def routes(self) -> list[Route]:
        """The table above."""
        get = {
            "/api/state": self._state,
            "/api/held": self._held,
            "/api/link": self._link,
            "/api/track": self._flown_track,
            "/api/connect": self._connect,
            "/connect.svg": self._connect_code,
            "/api/missions": self._missions,
            "/api/missions/{number}": self._mission,
            "/api/missions/{number}/difference/{other}": self._difference,
            "/api/logs": self._list_logs,
            "/api/logs/{name}": self._read_log,
            "/metrics": self._render_metrics,
        }
        return [
            *(Route(path, guarded(handler), methods=["GET"]) for path, handler in get.items()),
            Route("/api/missions/{number}/restore", guarded(self._restore), methods=["POST"]),
            *self._settings.routes(),
            *self._firmware.routes(),
            *self._pi.routes(),
            *self._map.routes(),
            Route("/api/check", guarded(self._check_file, MAX_FILE), methods=["POST"]),
            Route("/api/write", guarded(self._write_file, MAX_FILE), methods=["POST"]),
        ]

    async def _state(self, _request: Request) -> Response:
        daemon = self._daemon
        now = asyncio.get_running_loop().time()
        transfer, refused = daemon.bridge.missions.transfer, daemon.bridge.counters().refused
        try:
            listed = (await self._api.list_missions(1))["missions"]
            newest = {key: listed[0][key] for key in ("number", "outcome")} if listed else None
            newest_backup = await self._api.settings.newest_backup()
            store = daemon.store_trouble
        except StoreError as error:
            newest, newest_backup, store = None, None, str(error)
        return json_reply(
            {
                "version": version(),
                **asdict(daemon.report()),
                "traffic": {name: asdict(traffic) for name, traffic in daemon.traffic.items()},
                "port": {"address": daemon.fc.where, "trouble": daemon.fc.trouble},
                "refused": [f"{count} x {why} ({link})" for (link, why), count in refused.items()],
                "recording": daemon.recording,
                "track": self._track.state,
                "newest_mission": newest,
                "newest_backup": newest_backup,
                "store_trouble": store,
                "lost_s": None if daemon.fc.lost_at is None else round(now - daemon.fc.lost_at, 1),
                "transfer": None if transfer is None else asdict(transfer) | {"step": transfer.step.value},
                "write": self._writer.state,
                "map": self._map.state,
            }
        )

    async def _held(self, _request: Request) -> Response:
        """The mission as last read: an unauthenticated request must not use the flight controller's line."""
        held = self._daemon.bridge.missions.held
        if held is None:
            return json_reply({"count": None, "checksum": None, "items": []})
        if self._held_text is None or self._held_text[0] is not held:
            self._held_text = held, _held_text(held)
        return text_reply(self._held_text[1])

    async def _link(self, _request: Request) -> Response:
        return json_reply(self._history.to_json())

    async def _flown_track(self, request: Request) -> Response:
        return json_reply(self._track.to_json(whole(request.query_params.get("first", "0"))))

    async def _connect(self, _request: Request) -> Response:
        return json_reply(connect_help(self._listen, self._daemon.settings.gcs, self._host.ipv4_addresses()))

    async def _connect_code(self, _request: Request) -> Response:
        urls = page_urls(self._listen, self._host.ipv4_addresses())
        if not urls:
            raise HTTPException(
                HTTPStatus.NOT_FOUND, "Only this machine can open the page: see [web] in the configuration."
            )
        return Response(qr_code(urls[0]), media_type="image/svg+xml")

    async def _missions(self, _request: Request) -> Response:
        return json_reply(await answered(self._api.list_missions(_LISTED)))

    async def _mission(self, request: Request) -> Response:
        number = path_number(request, "number")

        async def make() -> tuple[str, bool]:
            mission = await self._find(number)
            text = await asyncio.to_thread(lambda: to_json(stored_mission(mission)))
            return text, mission["outcome"] != Outcome.PENDING.value

        return text_reply(await self._cache.get(str(number), make))

    async def _difference(self, request: Request) -> Response:
        number, other = path_number(request, "number"), path_number(request, "other")

        async def make() -> tuple[str, bool]:
            first, second = await self._find(number), await self._find(other)

            def compare() -> str:
                return to_json({"rows": [row.to_json() for row in difference(_sent(first), _sent(second))]})

            return await asyncio.to_thread(compare), True

        return text_reply(await self._cache.get(f"{number} {other}", make))

    async def _restore(self, request: Request) -> Response:
        check_token(request, self._token)
        number = path_number(request, "number")
        return begun(self._writer.begin(f"mission {number}", partial(self._api.restore, number)))

    async def _check_file(self, request: Request) -> Response:
        answer = await self._files.check(request)
        return text_reply(await asyncio.to_thread(to_json, answer))

    async def _write_file(self, request: Request) -> Response:
        check_token(request, self._token)
        return begun(await self._files.write(request))

    async def _list_logs(self, request: Request) -> Response:
        check_token(request, self._token)
        return json_reply(await _from_disk(self._logs.list()))

    async def _read_log(self, request: Request) -> Response:
        check_token(request, self._token)
        start = request.query_params.get("start", "0")
        piece = await _from_disk(self._logs.read(request.path_params["name"], whole(start)))
        return Response(piece, media_type="application/octet-stream")

    async def _render_metrics(self, _request: Request) -> Response:
        return Response(self._metrics.render(), media_type=CONTENT_TYPE)

    async def _find(self, number: int) -> Json:
        return await answered(self._api.show_mission(number))


def _sent(mission: Json) -> list[MissionItem]:
    return mission_items(mission["received"]["items"])


async def _from_disk(asked: Awaitable[T]) -> T:
    """Wait for the logs; errors become refusals."""
    try:
        return await asked
    except FileNotFoundError as error:
        raise HTTPException(HTTPStatus.NOT_FOUND, "There is no such log: it may have been removed.") from error
    except OSError as error:
        raise HTTPException(HTTPStatus.SERVICE_UNAVAILABLE, f"The logs cannot be read: {reason(error)}.") from error


def _held_text(held: HeldMission) -> str:
    identity, items = held.identity, [shown(item) for item in held.items]
    return to_json({"count": identity.count, "checksum": f"{identity.checksum:08x}", "items": items})
