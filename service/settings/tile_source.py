# SPDX-License-Identifier: GPL-3.0-or-later
"""The server of the page's map tiles: an address with {z}, {x} and {y}, as map programs write it."""

import re
from dataclasses import dataclass
from urllib.parse import urlsplit

from service.settings.addresses import AddressError

#: Its policy permits browsing and forbids saving areas for later: https://operations.osmfoundation.org/policies/tiles/
_VIEW_ONLY = "openstreetmap.org"
_PARTS = ("{z}", "{x}", "{y}")
_HOST = re.compile(r"[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)*(:(?P<port>[0-9]{1,5}))?")
#: Of what follows the host.
_TARGET = re.compile(r"/[A-Za-z0-9/._~!$&()*+,;=:@%?{}-]*")
_FORMS = 'write an address like "https://tiles.example.org/{z}/{x}/{y}.png"'


@dataclass(frozen=True, slots=True)
class TileSource:
    """`template`: the address of a tile. `origin`: its scheme and host; `target`: the rest."""

    template: str = "https://tile.openstreetmap.org/{z}/{x}/{y}.png"

    def __str__(self) -> str:
        return self.template

    @property
    def host(self) -> str:
        return urlsplit(self.template).netloc

    @property
    def origin(self) -> str:
        return self.template.partition(self.host)[0] + self.host

    @property
    def is_openstreetmap(self) -> bool:
        """True if it is OpenStreetMap's own server: the Pi must keep nothing of it."""
        return f".{self.host.partition(':')[0].lower()}".endswith(f".{_VIEW_ONLY}")

    def target(self, zoom: int, x: int, y: int) -> str:
        """The address of a tile, without the origin."""
        text = self.template.removeprefix(self.origin)
        for part, value in zip(_PARTS, (zoom, x, y), strict=True):
            text = text.replace(part, str(value))
        return text


def parse_tile_source(given: str) -> TileSource:
    """Read the address; AddressError gives the reason."""
    scheme, _, rest = given.partition("://")
    host, slash, target = rest.partition("/")
    server = _HOST.fullmatch(host)
    is_address = scheme in ("http", "https") and server and int(server["port"] or 0) < 1 << 16
    braces = sorted(re.findall(r"{.*?}|[{}]", target))
    if not is_address or not _TARGET.fullmatch(slash + target) or braces != sorted(_PARTS):
        raise AddressError(f"{given[:200]!r} is not an address of map tiles: {_FORMS}")
    return TileSource(given)
