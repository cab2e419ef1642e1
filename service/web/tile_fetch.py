# SPDX-License-Identifier: GPL-3.0-or-later
"""Fetches map tiles into files: a separate program, so that neither the daemon nor its stop waits for a network.

    python -m service.web.tile_fetch < REQUEST

REQUEST is a FetchRequest as JSON. Each line of the output is the FetchProgress as JSON. Tiles that are kept and have
not expired are not fetched again, so a request that was stopped continues when it is sent again.
"""

import json
import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from email.message import Message
from email.utils import parsedate_to_datetime
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

from service.web.tile_store import MAX_TILE, CacheFullError, TileCache, image_type
from storage.os_error import reason

#: Without a byte. The daemon ends this program if no tile is completed for longer.
_TIMEOUT_S = 20.0
_CONNECTIONS = 2
#: Without a date of the source: the least that OpenStreetMap asks of caches.
_EXPIRES_S = 7 * 86400
_REPORT_S = 0.2
_ABSENT = (HTTPStatus.NO_CONTENT, HTTPStatus.NOT_FOUND, HTTPStatus.GONE)


class FetchError(Exception):
    """The reason to stop; one sentence."""


@dataclass(frozen=True, slots=True)
class FetchRequest:
    """`levels`: for each zoom level, coarse ones first, the tiles' addresses on `origin` and their files.

    `folder`: of all kept tiles, at most `most_bytes` together.
    """

    origin: str
    agent: str
    folder: str
    most_bytes: int
    levels: Sequence[Sequence[tuple[str, str]]]


@dataclass(slots=True)
class FetchProgress:
    """`done` of `total` tiles, of which the source has no `absent`; all kept `tiles` and their `bytes`.

    `end`: None while it runs, then the reason why it stopped; empty if it is complete.
    """

    total: int
    done: int = 0
    absent: int = 0
    tiles: int = 0
    bytes: int = 0
    end: str | None = None


class TileFetch:
    """One request. `run` reports at most five times a second, and at the end."""

    def __init__(self, request: FetchRequest) -> None:
        self._request = request
        self._progress = FetchProgress(sum(map(len, request.levels)))
        wanted = {Path(file) for level in request.levels for _, file in level}
        self._cache = TileCache(Path(request.folder), request.most_bytes, wanted)
        self._lock = Lock()
        self._host = request.origin.partition("://")[2]
        kind = HTTPSConnection if request.origin.startswith("https:") else HTTPConnection
        #: Those that no thread uses.
        self._connections: SimpleQueue[HTTPConnection] = SimpleQueue()
        for _ in range(_CONNECTIONS):
            self._connections.put(kind(self._host, timeout=_TIMEOUT_S))
        self._reported = 0.0

    def run(self) -> None:
        try:
            with ThreadPoolExecutor(_CONNECTIONS) as threads:
                for level in self._request.levels:
                    if not self._fetch_level(level, threads):
                        break
            self._progress.total = self._progress.done  # the source has no finer levels
            end = ""
        except (FetchError, CacheFullError) as error:
            end = str(error)
        except OSError as error:
            end = f"The tiles cannot be stored: {reason(error)}."
        for _ in range(_CONNECTIONS):
            self._connections.get().close()
        self._report(end)

    def _fetch_level(self, level: Iterable[tuple[str, str]], threads: ThreadPoolExecutor) -> bool:
        """True if the source has tiles of this level."""
        try:
            return any([*threads.map(self._fetch, level)])
        except BaseException:
            threads.shutdown(wait=False, cancel_futures=True)
            raise

    def _fetch(self, tile: tuple[str, str]) -> bool:
        target, file = tile[0], Path(tile[1])
        is_there = self._cache.is_fresh(file, time.time())
        found = None if is_there else self._ask(target)
        with self._lock:
            if found is not None:
                self._cache.keep(file, *found)
                is_there = True
            self._progress.done += 1
            self._progress.absent += not is_there
            if time.monotonic() > self._reported + _REPORT_S:
                self._report()
        return is_there

    def _ask(self, target: str) -> tuple[bytes, float] | None:
        """A tile, and the time at which it expires; None if the source does not have it."""
        connection = self._connections.get()
        try:
            try:
                return self._ask_once(connection, target)
            except (OSError, HTTPException):
                return self._ask_once(connection, target)  # opened again: servers close those that are idle
        except TimeoutError as error:
            raise FetchError(f"{self._host} does not answer: a tile takes more than {_TIMEOUT_S:.0f} s.") from error
        except (OSError, HTTPException) as error:
            why = reason(error) or type(error).__name__
            raise FetchError(f"{self._host} does not answer: {why}.") from error
        finally:
            self._connections.put(connection)

    def _ask_once(self, connection: HTTPConnection, target: str) -> tuple[bytes, float] | None:
        try:
            connection.request("GET", target, headers={"User-Agent": self._request.agent, "Accept": "image/*"})
            response = connection.getresponse()
            data = response.read(MAX_TILE + 1)
            if response.length and len(data) <= MAX_TILE:
                raise HTTPException("the tile was cut off")
        except (OSError, HTTPException):
            connection.close()  # the next request opens it again
            raise
        if response.status in _ABSENT:
            return None
        if response.status != HTTPStatus.OK:
            raise FetchError(f"{self._host} refuses {target}: {response.status} {response.reason[:60]}.")
        if len(data) > MAX_TILE:
            raise FetchError(f"{self._host} sends tiles of more than {MAX_TILE >> 20} MB.")
        if image_type(data) is None:
            raise FetchError(f"{self._host} does not send map tiles: {target} is neither PNG, JPEG nor WebP.")
        return data, time.time() + lifetime_s(response.headers)

    def _report(self, end: str | None = None) -> None:
        progress = self._progress
        progress.tiles, progress.bytes, progress.end = self._cache.tiles, self._cache.bytes, end
        self._reported = time.monotonic()
        sys.stdout.write(f"{json.dumps(asdict(progress))}\n")
        sys.stdout.flush()


def lifetime_s(headers: Message) -> float:
    for word in headers.get("Cache-Control", "").replace(" ", "").split(","):
        name, _, value = word.partition("=")
        if name.lower() == "max-age" and value.isdecimal():
            return float(value[:9])
    try:
        return parsedate_to_datetime(headers["Expires"]).timestamp() - time.time()
    except (TypeError, ValueError):
        return _EXPIRES_S


def main() -> None:
    TileFetch(FetchRequest(**json.load(sys.stdin))).run()


if __name__ == "__main__":
    main()
