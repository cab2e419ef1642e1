# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[web]` table of the configuration file."""

from dataclasses import dataclass
from pathlib import Path

from service.settings.addresses import host_port, parse_host_port

_FORMS = 'write "0.0.0.0:8080" for the whole network, "127.0.0.1:8080" for this machine only'


@dataclass(frozen=True, slots=True)
class ListenAddress:
    """The address to listen on. 127.0.0.1 serves only this machine's own browsers."""

    host: str = "127.0.0.1"
    port: int = 8080

    def __str__(self) -> str:
        return host_port(self.host, self.port)


@dataclass(frozen=True, slots=True)
class WebSettings:
    """`hosts`: further names of this machine. `token_file` None: `web-token` in the state directory."""

    listen: ListenAddress = ListenAddress()
    hosts: tuple[str, ...] = ()
    token_file: Path | None = None


def parse_listen(text: str) -> ListenAddress:
    """Read "HOST:PORT"; AddressError gives the reason."""
    return ListenAddress(*parse_host_port(text, text, _FORMS))
