# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[zenoh]` table of the configuration file."""

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from payloads.keys import PayloadEncoding
from payloads.names import DEFAULT_PREFIX, host_name

#: The value that allows commands without authentication.
I_KNOW = "I know"


class ZenohProfile(Enum):
    """The data volume of a vehicle's link."""

    FULL = "full"
    METERED = "metered"


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """The `[zenoh]` table. Endpoints are in zenoh's form: "tcp/192.168.4.1:7447".

    `config_file`: a zenoh configuration file; the bridge's defaults complete it.
    `commands`: True if @cmd is answered; without authentication only if `commands_without_authentication` is "I know".
    """

    prefix: str = DEFAULT_PREFIX
    vehicle: str = field(default_factory=host_name)
    encoding: PayloadEncoding = PayloadEncoding.JSON
    profile: ZenohProfile = ZenohProfile.FULL
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config_file: Path | None = None
    commands: bool = False
    commands_without_authentication: str = ""
    mavlink_in: bool = False
