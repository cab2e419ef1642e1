# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the tiles of an area for the field, with a process that fetches them (service.web.tile_fetch)."""

import asyncio
import json
import shutil
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict

import structlog

from payloads.mission_data import Json, to_json
from service.daemon.daemon import Daemon
from service.machine.package import address, version
from service.settings.web import TileSource
from service.web.tile_area import TileArea
from service.web.tile_fetch import FetchProgress, FetchRequest
from service.web.tile_store import TileStore

MOST_TILES = 2000
_MOST_BYTES = 256 << 20
#: For missions and logs.
_LEAST_FREE = 512 << 20
_PROGRAM = (sys.executable, "-I", "-m", "service.web.tile_fetch")
_LOOK_S = 0.5
#: More than two tiles' deadlines, because a tile is requested twice.
_SILENCE_S = 60.0
_NOT_ALLOWED = (
    "OpenStreetMap's server does not allow saving areas. Name a server that does in the setting web.map_tiles."
)
_log = structlog.get_logger()


class TileKeeping:
    """One area at a time. `state`: the current or latest one as the page shows it, None before the first.

    `kept` is called with the number and the bytes of all kept tiles.
    """

    def __init__(self, daemon: Daemon, store: TileStore, source: TileSource, kept: Callable[[int, int], None]) -> None:
        self._daemon = daemon
        self._store = store
        self._source = source
        self._kept = kept
        self._task: asyncio.Task[None] | None = None
        self._process: Process | None = None
        self._is_stopped = False
        self.state: Json | None = None

    @property
    def is_running(self) -> bool:
        return self._task is not None and not self._task.done()

    def begin(self, area: TileArea) -> None:
        """Start to fetch; ValueError says why an area cannot be kept."""
        if self._source.is_openstreetmap:
            raise ValueError(_NOT_ALLOWED)
        count = sum(level.count for level in area.levels())
        if count > MOST_TILES:
            raise ValueError(f"This area has {count} tiles; at most {MOST_TILES} are kept at once: zoom in.")
        self._is_stopped = False
        self.state = {**asdict(FetchProgress(count)), "running": True, "text": ""}
        self._task = asyncio.get_running_loop().create_task(self._run(area, self.state))

    def stop(self) -> None:
        """End it; the tiles that it has fetched are kept."""
        self._is_stopped = True
        self._kill()

    async def close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self, area: TileArea, state: Json) -> None:
        text = "The daemon failed; see its log."
        try:
            text = await self._fetch(area, state)
        except OSError as error:
            text = f"The tiles cannot be fetched: {error.strerror}."
        except Exception:
            _log.exception("web.failed", path="/api/map/keep")
        finally:
            self._kill()
            if state["tiles"]:
                self._kept(state["tiles"], state["bytes"])
            state |= {"running": False, "text": text}

    async def _fetch(self, area: TileArea, state: Json) -> str:
        """Returns the result, a sentence."""
        request = await asyncio.to_thread(self._request, area)
        self._process = await asyncio.create_subprocess_exec(*_PROGRAM, stdin=PIPE, stdout=PIPE)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(to_json(asdict(request)).encode())
        self._process.stdin.close()
        lines, silence_s = self._process.stdout, 0.0
        progress = FetchProgress(state["total"])
        while progress.end is None:
            if self._daemon.report().last_heard.armed:
                return _unfinished("The craft was armed.", progress)
            try:
                line = await asyncio.wait_for(lines.readline(), _LOOK_S)
            except TimeoutError:
                silence_s += _LOOK_S
                if silence_s >= _SILENCE_S:
                    return _unfinished(f"{self._source.host} does not answer.", progress)
                continue
            if self._is_stopped:
                return _unfinished("Stopped.", progress)
            if not line:
                return _unfinished("The program that fetches them ended.", progress)
            silence_s, progress = 0.0, FetchProgress(**json.loads(line))
            state |= asdict(progress)
        return _unfinished(progress.end, progress) if progress.end else _finished(progress)

    def _request(self, area: TileArea) -> FetchRequest:
        folder = self._store.folder
        folder.mkdir(parents=True, exist_ok=True)
        if shutil.disk_usage(folder).free < _LEAST_FREE:
            raise OSError(None, f"less than {_LEAST_FREE >> 20} MB of the card are free")
        levels = [
            [(self._source.target(*place), str(self._store.file(place))) for place in level.tiles()]
            for level in area.levels()
        ]
        contact = address("Repository")
        agent = f"naze-bridge/{version()}{'' if contact is None else f' (+{contact})'}"
        return FetchRequest(self._source.origin, agent, str(folder), _MOST_BYTES, levels)

    def _kill(self) -> None:
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()


def _unfinished(why: str, progress: FetchProgress) -> str:
    return f"{why} {progress.done - progress.absent} of {progress.total} tiles are kept; press again to continue."


def _finished(progress: FetchProgress) -> str:
    absent = f" {progress.absent} more do not exist." if progress.absent else ""
    return f"{progress.done - progress.absent} tiles of this area are kept.{absent}"
