"""The page's own files, held in memory: a browser makes nobody wait for the SD card."""

import hashlib
from pathlib import Path

from aiohttp import web

from service.web.access import Handler

_FOLDER = Path(__file__).parent / "static"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}


def static_routes() -> list[web.RouteDef]:
    """Return a route for each file; index.html is the page itself."""
    files = sorted(path for path in _FOLDER.iterdir() if path.suffix in _TYPES)
    return [web.get("/" if path.name == "index.html" else f"/{path.name}", _file(path)) for path in files]


def _file(path: Path) -> Handler:
    body, kind = path.read_bytes(), _TYPES[path.suffix]
    etag = hashlib.sha256(body).hexdigest()[:16]

    async def serve(request: web.Request) -> web.Response:
        # Asked for anew each time, so that a page never runs on the files of two versions.
        known = request.if_none_match or ()
        if any(tag.value == etag for tag in known):
            response = web.Response(status=304)
        else:
            response = web.Response(body=body, content_type=kind, charset="utf-8")
        response.etag = etag
        response.headers["Cache-Control"] = "no-cache"
        return response

    return serve
