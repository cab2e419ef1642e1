# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[web]` table of the configuration file."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

from service.settings.addresses import AddressError, host_port, parse_host_port
from service.settings.key import Example, Unfit, file_name, several, text

_FORMS = 'write "0.0.0.0:8080" for the whole network, "127.0.0.1:8080" for this machine only'
_PARTS = ("{z}", "{x}", "{y}")
_HOST = re.compile(r"[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)*(:(?P<port>[0-9]{1,5}))?")
#: The path of a template.
_TARGET = re.compile(r"/[A-Za-z0-9/._~!$&()*+,;=:@%?{}-]*")
_TILE_FORMS = 'write an address like "https://tiles.example.org/{z}/{x}/{y}.png"'


@dataclass(frozen=True, slots=True)
class TileSource:
    """A server of map tiles. `template`: a tile's address with {z}, {x} and {y}, as map programs write it."""

    template: str = "https://tile.openstreetmap.org/{z}/{x}/{y}.png"

    def __str__(self) -> str:
        return self.template

    @property
    def origin(self) -> str:
        """The scheme and the host."""
        scheme, host, *_ = urlsplit(self.template)
        return f"{scheme}://{host}"


def parse_tile_source(given: str) -> TileSource:
    """Read the address. AddressError gives the reason."""
    scheme, _, rest = given.partition("://")
    host, slash, target = rest.partition("/")
    server = _HOST.fullmatch(host)
    is_address = scheme in ("http", "https") and server and int(server["port"] or 0) < 1 << 16
    braces = sorted(re.findall(r"{.*?}|[{}]", target))
    if not is_address or not _TARGET.fullmatch(slash + target) or braces != sorted(_PARTS):
        raise AddressError(f"{given[:200]!r} is not an address of map tiles: {_TILE_FORMS}")
    return TileSource(given)


@dataclass(frozen=True, slots=True)
class ListenAddress:
    """The address to listen on. 127.0.0.1 serves only this machine's own browsers."""

    host: str = "127.0.0.1"
    port: int = 8080

    def __str__(self) -> str:
        return host_port(self.host, self.port)


def parse_listen(given: str) -> ListenAddress:
    """Read "HOST:PORT". AddressError gives the reason."""
    return ListenAddress(*parse_host_port(given, given, _FORMS))


def _host_name(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or re.fullmatch(r"[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)*", entry) is None:
        raise Unfit(f'holds {entry!r}, which is not a host name: write one like "naze-1.example.ts.net"')
    return entry.lower()


def _origin(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or re.fullmatch(r"https?://[A-Za-z0-9.-]+(:[0-9]{1,5})?", entry) is None:
        raise Unfit(f'holds {entry!r}, which is not an origin: write one like "https://fleet.example.org"')
    return entry.lower()


@dataclass(frozen=True, slots=True)
class WebSettings:
    """The settings of the status page."""

    listen: Annotated[
        ListenAddress,
        text('"HOST:PORT"', parse_listen),
        "Address of the status page: 0.0.0.0:8080 for the whole network, 127.0.0.1:8080 for this machine only.",
    ] = ListenAddress()
    hosts: Annotated[
        tuple[str, ...],
        several('as in ["naze-1.example.ts.net"]', _host_name),
        "Full names by which browsers may open the page; addresses and local names always work.",
    ] = ()
    token_file: Annotated[
        Path | None,
        file_name(in_config_folder=True),
        "File with the token for writing missions and fetching logs, created if it is missing. By default web-token in"
        " state_dir.",
        Example('"/etc/naze-bridge/web-token"'),
    ] = None
    map_tiles: Annotated[
        TileSource,
        text('"https://HOST/{z}/{x}/{y}.png"', parse_tile_source),
        "Server of the map's tiles, which a browser fetches itself once they are switched on in it.",
    ] = TileSource()  # frozen
    map_credit: Annotated[
        str | None,
        text(),
        "The credit that the licence of map_tiles requires on the map. By default that of OpenStreetMap, or the"
        " server's name.",
        Example('"Example Survey, CC BY 4.0"'),
    ] = None
    origins: Annotated[
        tuple[str, ...],
        several('as in ["https://fleet.example.org"]', _origin),
        "Origins of other web applications whose scripts may use this page's interface, each with scheme and port.",
    ] = ()
