# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[web]` table of the configuration file."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from service.settings.addresses import host_port, parse_host_port
from service.settings.key import Example, Unfit, file_name, several, text
from service.settings.tile_source import TileSource, parse_tile_source

_FORMS = 'write "0.0.0.0:8080" for the whole network, "127.0.0.1:8080" for this machine only'


@dataclass(frozen=True, slots=True)
class ListenAddress:
    """The address to listen on. 127.0.0.1 serves only this machine's own browsers."""

    host: str = "127.0.0.1"
    port: int = 8080

    def __str__(self) -> str:
        return host_port(self.host, self.port)


def parse_listen(given: str) -> ListenAddress:
    """Read "HOST:PORT"; AddressError gives the reason."""
    return ListenAddress(*parse_host_port(given, given, _FORMS))


def _host_name(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or re.fullmatch(r"[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)*", entry) is None:
        raise Unfit(f'holds {entry!r}, which is not a host name: write one like "naze-1.example.ts.net"')
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
        "Server of the map's tiles. They are off until you switch them on in the page; of OpenStreetMap's server the Pi"
        " keeps none.",
    ] = TileSource()  # noqa: RUF009  # frozen
    map_credit: Annotated[
        str | None,
        text(),
        "The credit that the licence of map_tiles requires on the map. By default that of OpenStreetMap, or the"
        " server's name.",
        Example('"Example Survey, CC BY 4.0"'),
    ] = None
