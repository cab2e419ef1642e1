# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests: JSON over GET. Writing a mission and fetching logs need the token.

docs/status-page.md, "For programs", describes them.
"""

import asyncio
import ipaddress
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict
from functools import partial
from http import HTTPStatus

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from bridge.settings.local_settings import by_parameter
from payloads.comparison import shown, stored_mission
from payloads.mission_data import ACCEPTED, Json, plain, to_json
from payloads.settings_comparison import SettingValues
from protocols.param_file import write_param_file
from service.daemon.api import DaemonApi
from service.daemon.client import ControlError
from service.daemon.daemon import Daemon
from service.daemon.telemetry_logs import TelemetryLogs
from service.machine.host import Host
from service.machine.package import version
from service.recording.tlog_recorder import TLOG_FOLDER
from service.settings.addresses import GcsAddress, client_hosts, is_any_address
from service.settings.web import ListenAddress, WebSettings
from service.web.access import check_token, refusing, route
from service.web.metrics import CONTENT_TYPE, Metrics
from service.web.pi_control import PiControl
from service.web.replies import Turns, json_reply, text_reply, whole
from service.web.sent_files import MissionWriter, Progress, SentFiles
from storage.store_error import StoreError

#: Mission Planner's name for the connection type to choose.
_CONNECTIONS = {"udpin": "UDPCl", "tcpin": "TCP"}
_LISTED = 50
_NO_LOG = "There is no such log: it may have been removed."


class Api:
    """Answers from DaemonApi and the bridge's report."""

    def __init__(self, daemon: Daemon, settings: WebSettings) -> None:
        self._daemon = daemon
        self._listen = settings.listen
        self._api = DaemonApi(daemon)
        self._metrics = Metrics(daemon)
        self._turns = Turns()
        self._writer = MissionWriter()
        self._files = SentFiles(self._api, self._writer)
        self._pi = PiControl(daemon, self._writer)
        self._map = {"tiles": str(settings.map_tiles), "credit": settings.map_credit}
        state_dir = daemon.settings.state_dir
        self._logs = TelemetryLogs(None if state_dir is None else state_dir / TLOG_FOLDER)
        self._host = Host()

    async def close(self) -> None:
        await self._writer.close()
        await self._pi.close()
        self._logs.close()

    def routes(self) -> list[Route]:
        return [
            route("GET", "/api/state", self._state),
            route("GET", "/api/held", self._held),
            route("GET", "/api/connect", self._connect),
            route("GET", "/api/missions", self._missions),
            route("GET", "/api/missions/{number}", self._mission),
            route("POST", "/api/missions/{number}/restore", self._restore, check_token),
            route("POST", "/api/signing/reset", self._reset_signing, check_token),
            route("GET", "/api/logs", self._list_logs, check_token),
            route("GET", "/api/logs/{name}", self._read_log, check_token),
            route("GET", "/metrics", self._render_metrics),
            route("GET", "/api/settings", self._list_settings),
            route("GET", "/api/settings/{number}", self._show_settings),
            route("GET", "/api/settings/{number}/file", self._settings_file),
            route("POST", "/api/settings/{number}/restore", self._restore_settings, check_token),
            route("POST", "/api/declination", self._set_declination, check_token),
            *self._files.routes(),
            *self._pi.routes(),
        ]

    async def _state(self, _request: Request) -> Response:
        """The current state, requested once a second by an open page."""
        daemon = self._daemon
        now = asyncio.get_running_loop().time()
        transfer, counters = daemon.bridge.missions.transfer, daemon.bridge.counters()
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
                "refused": [f"{count} x {why} ({link})" for (link, why), count in counters.refused.items()],
                "recording": daemon.recording,
                "newest_mission": newest,
                "newest_backup": newest_backup,
                "store_trouble": store,
                "clock_trouble": daemon.clock_trouble,
                "declination": counters.declination,
                "lost_s": None if daemon.fc.lost_at is None else round(now - daemon.fc.lost_at, 1),
                "transfer": None if transfer is None else asdict(transfer) | {"step": transfer.step.value},
                "write": self._writer.state,
                "map": self._map,
            }
        )

    async def _held(self, _request: Request) -> Response:
        """The mission as last read: an unauthenticated request must not use the flight controller's line."""
        held = self._daemon.bridge.missions.held
        if held is None:
            return json_reply({"count": None, "checksum": None, "items": [], "path": []})
        identity, items = held.identity, [shown(item) for item in held.items]
        path = list(map(plain, held.path))
        return json_reply(
            {"count": identity.count, "checksum": f"{identity.checksum:08x}", "items": items, "path": path}
        )

    async def _connect(self, _request: Request) -> Response:
        return json_reply(connect_help(self._listen, self._daemon.settings.gcs, self._host.ipv4_addresses()))

    async def _missions(self, _request: Request) -> Response:
        return json_reply(await self._api.list_missions(_LISTED))

    async def _mission(self, request: Request) -> Response:
        """A mission as sent and as stored."""
        number = whole(request.path_params["number"])
        async with self._turns.take():
            mission = await self._api.show_mission(number)
            return text_reply(await asyncio.to_thread(lambda: to_json(stored_mission(mission))))

    async def _restore(self, request: Request) -> Response:
        number = whole(request.path_params["number"])
        return self._writer.write(f"mission {number}", partial(self._api.restore, number))

    async def _list_settings(self, _request: Request) -> Response:
        return json_reply(await self._api.settings.backups(_LISTED))

    async def _show_settings(self, request: Request) -> Response:
        """The changes in a backup, and the changes that restoring it would make now.

        An unauthenticated request never uses the flight controller's line.
        """
        async with self._turns.take():
            backup = await self._find_settings(request)
            try:
                plan: Json = await self._api.settings.plan(backup["values"], backup["kind"], is_checked=False)
            except ControlError as error:
                plan = {"refused": str(error)}
            del backup["values"]
            return json_reply(backup | {"plan": plan})

    async def _settings_file(self, request: Request) -> Response:
        backup = await self._find_settings(request)
        text = write_param_file(by_parameter(backup["values"]), backup["kind"])
        headers = {"Content-Disposition": f'attachment; filename="settings-{backup["number"]}.param"'}
        return Response(text, headers=headers, media_type="application/octet-stream")

    async def _restore_settings(self, request: Request) -> Response:
        backup = await self._find_settings(request)
        return self._write_settings(f"settings {backup['number']}", backup["values"], backup["kind"])

    async def _set_declination(self, _request: Request) -> Response:
        if (wrong := self._daemon.bridge.counters().declination) is None:
            raise ControlError("The declination is right, or not known yet.")
        _, setting, needed = wrong
        return self._write_settings(setting, {setting: needed}, "")

    def _write_settings(self, what: str, values: SettingValues, kind: str) -> Response:
        async def write(progress: Progress) -> Json:
            result = await self._api.settings.restore(values, kind, "status page", progress)
            return {"ack": ACCEPTED if result["is_saved"] else "", "text": result["text"]}

        return self._writer.write(what, write, "settings")

    async def _find_settings(self, request: Request) -> Json:
        return await self._api.settings.backup(whole(request.path_params["number"]))

    async def _reset_signing(self, _request: Request) -> Response:
        return json_reply(await self._api.do({"do": "reset-signing"}, lambda _: None))

    async def _list_logs(self, _request: Request) -> Response:
        with _refusing_logs():
            return json_reply(await self._logs.list())

    async def _read_log(self, request: Request) -> Response:
        """One piece of a log, from byte `start` on."""
        start = whole(request.query_params.get("start", "0"))
        with _refusing_logs(), refusing(FileNotFoundError, HTTPStatus.NOT_FOUND, lambda _: _NO_LOG):
            piece = await self._logs.read(request.path_params["name"], start)
        return Response(piece, media_type="application/octet-stream")

    async def _render_metrics(self, _request: Request) -> Response:
        return Response(self._metrics.render(), media_type=CONTENT_TYPE)


def _refusing_logs() -> AbstractContextManager[None]:
    return refusing(OSError, HTTPStatus.SERVICE_UNAVAILABLE, lambda why: f"The logs cannot be read: {why}.")


def page_urls(listen: ListenAddress, own: Iterable[str]) -> list[str]:
    """The page's addresses for other devices; none if only this machine can open it. own: this machine's addresses."""
    hosts = own if is_any_address(listen.host) else [] if _is_loopback(listen.host) else [listen.host]
    return [f"http://{ListenAddress(host, listen.port)}/" for host in hosts]


def connect_help(listen: ListenAddress, links: Sequence[GcsAddress], own: list[str]) -> Json:
    """Lines for a ground station: the connection in Mission Planner's words, hosts and port."""
    stations = [
        {
            "connection": _CONNECTIONS[link.kind],
            "hosts": client_hosts(link.host, own),
            "port": link.port,
        }
        for link in links
        if link.kind in _CONNECTIONS
    ]
    called = [str(link) for link in links if link.kind not in _CONNECTIONS]
    return {"pages": page_urls(listen, own), "stations": stations, "called": called}


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
