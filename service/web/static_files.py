# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's own files, held in memory: no request waits for the SD card."""

import hashlib
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from service.web.access import Handler, content_policy

_FOLDER = Path(__file__).parent / "static"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}


def static_files(image_origin: str) -> Iterator[tuple[str, Handler]]:
    """Yield the path and the handler of each file; index.html is the page itself.

    `image_origin`: see access.content_policy.
    """
    policy = content_policy(image_origin)
    for file in sorted(_FOLDER.iterdir()):
        if file.suffix in _TYPES:
            yield "/" if file.name == "index.html" else f"/{file.name}", _handler(file, policy)


def _handler(file: Path, policy: str) -> Handler:
    body, kind = file.read_bytes(), _TYPES[file.suffix]
    # Also of the policy: Chromium keeps its stored copy's policy after a 304.
    etag = f'"{hashlib.sha256(body + policy.encode()).hexdigest()[:16]}"'
    # Never cached, so that a page does not mix files of two versions.
    headers = {"ETag": etag, "Cache-Control": "no-cache", "Content-Security-Policy": policy}

    async def serve(request: Request) -> Response:
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
        return Response(body, headers=headers, media_type=kind)

    return serve
