# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[zenoh]` table of the configuration file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from bridge.model.vehicle_groups import Group
from payloads.keys import PayloadEncoding
from payloads.names import DEFAULT_PREFIX, ZenohSettingsError, host_name

#: The value that allows commands without authentication.
I_KNOW = "I know"


class ZenohProfile(Enum):
    """The data volume of a vehicle's link."""

    FULL = "full"
    METERED = "metered"


#: The name of the vehicle's state among the groups in tables of rates.
STATE_NAME = "state"
_MAX_RATE_HZ = 50.0


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """The `[zenoh]` table. Endpoints are in zenoh's form: "tcp/192.168.4.1:7447".

    `config_file`: a zenoh configuration file; the bridge's defaults complete it.
    `rates`: maximum rate of a group, or of "state", Hz; 0: never.
    `commands`: True if @cmd is answered; without authentication only if `commands_without_authentication` is "I know".
    """

    prefix: str = DEFAULT_PREFIX
    vehicle: str = field(default_factory=host_name)
    encoding: PayloadEncoding = PayloadEncoding.JSON
    profile: ZenohProfile = ZenohProfile.FULL
    rates: Mapping[str, float] = field(default_factory=dict)
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config_file: Path | None = None
    commands: bool = False
    commands_without_authentication: str = ""
    mavlink_in: bool = False


def check_rates(rates: object) -> dict[str, float]:
    """Read rates in Hz by the groups' names, and "state"; ZenohSettingsError."""
    names = [*(group.value for group in Group), STATE_NAME]
    assert isinstance(rates, dict)  # checked by the settings' reader
    for name, hz in rates.items():
        if name not in names:
            raise ZenohSettingsError(f"zenoh.rates has no group {name!r}: there are {', '.join(names)}")
        if isinstance(hz, bool) or not isinstance(hz, int | float) or not 0 <= hz <= _MAX_RATE_HZ:
            raise ZenohSettingsError(f"zenoh.rates.{name} must be a rate in Hz, 0 to {_MAX_RATE_HZ:.0f}; 0: never")
    return {name: float(hz) for name, hz in rates.items()}
