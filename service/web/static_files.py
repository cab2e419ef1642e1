# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's own files, held in memory: no request waits for the SD card."""

import secrets
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from service.web.access import Handler

_FOLDER = Path(__file__).parent / "static"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}


def static_files() -> Iterator[tuple[str, Handler]]:
    """Yield the path and the handler of each file; index.html is the page itself."""
    # Of this start: Chromium keeps the headers of its stored copy, too.
    etag = f'"{secrets.token_hex(8)}"'
    for file in sorted(_FOLDER.iterdir()):
        if file.suffix in _TYPES:
            yield "/" if file.name == "index.html" else f"/{file.name}", _handler(file, etag)


def _handler(file: Path, etag: str) -> Handler:
    body, kind = file.read_bytes(), _TYPES[file.suffix]
    # Never cached, so that a page does not mix files of two versions.
    headers = {"ETag": etag, "Cache-Control": "no-cache"}

    async def serve(request: Request) -> Response:
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
        return Response(body, headers=headers, media_type=kind)

    return serve
