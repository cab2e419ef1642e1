# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[zenoh]` table of the configuration file."""

import re
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated

from payloads.names import DEFAULT_PREFIX, check_name, host_name
from service.settings.key import Example, Unfit, file_name, several, text

#: Over a network with a port, or a path, as of a serial port.
_ENDPOINT = re.compile(r"(?:tcp|udp|tls|quic|ws)/[^/]+:\d{1,5}(?:[?#].*)?|(?!tcp|udp|tls|quic|ws)[a-z-]+/.+")
#: The value that allows commands without authentication.
I_KNOW = "I know"


def _endpoint(entry: object, _folder: Path) -> str:
    if not isinstance(entry, str) or not _ENDPOINT.fullmatch(entry):
        raise Unfit(f'holds {entry!r}, which is not an endpoint: write one like "tcp/192.168.4.1:7447"')
    return entry


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """The `[zenoh]` table. Endpoints are in zenoh's form: "tcp/192.168.4.1:7447".

    `config_file`: a zenoh configuration file. The bridge's defaults complete it.
    """

    prefix: Annotated[str, text(parse=partial(check_name, "zenoh.prefix")), "First chunk of all zenoh keys."] = (
        DEFAULT_PREFIX
    )
    vehicle: Annotated[
        str,
        text(parse=partial(check_name, "zenoh.vehicle")),
        "This vehicle's name, the second chunk; unique within a fleet. By default the host's name.",
        Example('"naze-1"'),
    ] = field(default_factory=host_name)
    connect: Annotated[
        tuple[str, ...],
        several('as in ["tcp/192.168.4.1:7447"]', _endpoint),
        "Endpoints to join: a router or other peers.",
    ] = ()
    listen: Annotated[
        tuple[str, ...],
        several('as in ["tcp/0.0.0.0:7447"]', _endpoint),
        "Endpoints on which to accept other sessions.",
    ] = ()
    config_file: Annotated[
        Path | None,
        file_name(in_config_folder=True),
        "A zenoh configuration file, for TLS, passwords, access control, namespace.",
        Example('"zenoh.json5"'),
    ] = None
    commands: Annotated[
        bool, "Allow writing and clearing missions over zenoh; the transport must be authenticated."
    ] = False
    commands_without_authentication: Annotated[
        str,
        text(f'"{I_KNOW}", or omitted'),
        f'"{I_KNOW}": accept commands without authentication, from anyone who reaches the session.',
        Example(f'"{I_KNOW}"'),
    ] = ""
    mavlink_in: Annotated[bool, "Accept raw MAVLink frames over zenoh, under the same condition as commands."] = False
