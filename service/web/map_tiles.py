# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's requests about the map's tiles: off until they are switched on, then for every browser.

The Pi fetches only from the source in the settings, and only after the request "keep", never while the craft is armed.
"""

from http import HTTPStatus

import structlog
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from payloads.mission_data import Json
from service.daemon.daemon import Daemon
from service.machine.state_file import StateFile
from service.settings import default_state_dir
from service.settings.web import WebSettings
from service.web.access import check_token, refusing, route
from service.web.pi_control import check_disarmed
from service.web.replies import json_reply, path_number
from service.web.tile_area import FINEST_SHOWN, TileArea
from service.web.tile_keeping import TileKeeping
from service.web.tile_store import TileStore

_FOLDER = "map-tiles"
_FILE = "map.json"
#: A view on a large screen has about 60.
_MOST_ASKED = 200
_OSM_CREDIT, _OSM_PAGE = "© OpenStreetMap contributors", "https://www.openstreetmap.org/copyright"
_log = structlog.get_logger()


class MapTiles:
    """The choice, and the kept tiles."""

    def __init__(self, daemon: Daemon, settings: WebSettings) -> None:
        state_dir = daemon.settings.state_dir or default_state_dir()
        self._daemon = daemon
        self._source = settings.map_tiles
        self._credit = settings.map_credit
        self._file = StateFile(state_dir, _FILE, "the map has no tiles until they are switched on again")
        self._store = TileStore(state_dir / _FOLDER, self._source)
        self._keeping = TileKeeping(daemon, self._store, self._source, self._count)
        self._is_on, self._tiles, self._bytes = self._file.load(
            lambda kept: (bool(kept["on"]), int(kept["tiles"]), int(kept["bytes"]))
        ) or (False, 0, 0)

    @property
    def image_origin(self) -> str:
        """The only other origin from which the page may load pictures; empty while tiles are off."""
        return self._source.origin if self._is_on else ""

    @property
    def state(self) -> Json:
        is_osm = self._source.is_openstreetmap
        return {
            "on": self._is_on,
            "source": str(self._source),
            "host": self._source.host,
            "finest": FINEST_SHOWN,
            "credit": self._credit or (_OSM_CREDIT if is_osm else self._source.host),
            "credit_page": _OSM_PAGE if is_osm else None,
            "can_keep": not is_osm,
            "tiles": self._tiles,
            "bytes": self._bytes,
            "keeping": self._keeping.state,
        }

    def routes(self) -> list[Route]:
        return [
            route("GET", "/api/map/kept", self._kept, self._check_on),
            route("GET", "/api/map/tiles/{zoom}/{x}/{y}", self._tile, self._check_on),
            route("POST", "/api/map", self._switch, check_token),
            route("POST", "/api/map/keep", self._keep, check_token, self._check_on, self._check_idle),
            route("POST", "/api/map/stop", self._stop, check_token),
            route("POST", "/api/map/forget", self._forget, check_token, self._check_idle),
        ]

    async def close(self) -> None:
        await self._keeping.close()
        self._store.close()
        self._file.close()

    async def _kept(self, request: Request) -> Response:
        """Which tiles of an area can be drawn from those kept on the Pi."""
        with refusing(ValueError, HTTPStatus.UNPROCESSABLE_ENTITY):
            area = TileArea.from_query(request.query_params)
        if area.count > _MOST_ASKED:
            raise HTTPException(HTTPStatus.UNPROCESSABLE_ENTITY, f"At most {_MOST_ASKED} tiles are looked up at once.")
        with refusing(OSError, HTTPStatus.SERVICE_UNAVAILABLE, lambda why: f"Tiles cannot be read: {why}."):
            return json_reply(await self._store.kept(area.tiles()))

    async def _tile(self, request: Request) -> Response:
        zoom, x, y = (path_number(request, name) for name in ("zoom", "x", "y"))
        with refusing(OSError, HTTPStatus.NOT_FOUND, lambda why: f"This tile cannot be read: {why}."):
            data, kind = await self._store.read((zoom, x, y))
        return Response(data, headers={"Cache-Control": "private, max-age=3600"}, media_type=kind)

    async def _switch(self, request: Request) -> Response:
        self._is_on = request.query_params.get("on") == "1"
        _log.info("web.map_tiles", on=self._is_on, source=self._source.host)
        if not self._is_on:
            self._keeping.stop()
        self._save()
        return json_reply(self.state)

    async def _keep(self, request: Request) -> Response:
        """Fetch an area and its finer levels; the progress is in the state."""
        check_disarmed(self._daemon)
        with refusing(ValueError, HTTPStatus.UNPROCESSABLE_ENTITY):
            self._keeping.begin(TileArea.from_query(request.query_params))
        return json_reply(self.state, HTTPStatus.ACCEPTED)

    async def _stop(self, _request: Request) -> Response:
        self._keeping.stop()
        return json_reply(self.state)

    async def _forget(self, _request: Request) -> Response:
        self._store.forget()
        self._count(0, 0)
        return json_reply(self.state)

    def _check_on(self, _request: Request) -> None:
        if not self._is_on:
            raise HTTPException(HTTPStatus.NOT_FOUND, "Map tiles are off.")

    def _check_idle(self, _request: Request) -> None:
        if self._keeping.is_running:
            raise HTTPException(HTTPStatus.CONFLICT, "An area is being fetched: stop that first.")

    def _count(self, tiles: int, size: int) -> None:
        self._tiles, self._bytes = tiles, size
        self._save()

    def _save(self) -> None:
        self._file.save({"on": self._is_on, "tiles": self._tiles, "bytes": self._bytes})
