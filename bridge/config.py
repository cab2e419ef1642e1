# SPDX-License-Identifier: GPL-3.0-or-later
"""The configuration of one bridge."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M
from bridge.controllers.table import PROFILES
from bridge.fc.profile import Profile
from bridge.gcs.rights import LinkAccess
from bridge.model.craft import FlightMemory
from bridge.model.settings import BoardId, SettingsMemory, Value


class PassThroughRule(Enum):
    """The messages that an autopilot in pass-through gets over links without a key or a list of writers."""

    MISSIONS = "missions"
    EVERYTHING = "everything"


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeSettings:
    """The owner's settings of the bridge.

    A field is all that a setting needs: service/settings/table.py derives the key, reader and documentation from it.
    """

    sysid: Annotated[int, range(1, 256), "MAVLink system id of the vehicle, 1..255."] = 1
    takeoff_max_m: Annotated[
        int,
        range(2, 256),
        "Maximum take-off altitude of a mission, metres, 2..255; a higher one is lowered to it.",
    ] = TAKEOFF_MAX_M
    pass_through: Annotated[
        PassThroughRule,
        "Messages for an autopilot in pass-through from links without key_file or writers: "
        '"missions" (and parameters and requests), or "everything", including arming, modes, control and Set WP on an'
        " INAV.",
    ] = PassThroughRule.MISSIONS


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """The configuration of one bridge. `speeds`: of the port, baud; (None,) if it lacks a speed.

    `version`: of the bridge itself. `unix_time_s`: the time of day at a monotonic time, None if unknown.
    `access`: the rules by link name. A link without rules is open to all. `is_near`: True for an IP address on
    this machine's own networks, without a router in between. `has_log`: there is a telemetry log. `flight`: of the
    craft that a previous bridge left armed. `settings_memory`: of the settings of the boards seen before.
    """

    speeds: Sequence[int | None]
    settings: BridgeSettings = BridgeSettings()  # frozen
    compid: int = 1
    profiles: Sequence[Profile] = PROFILES
    access: Mapping[str, LinkAccess] = field(default_factory=dict)
    is_near: Callable[[str], bool] = lambda _address: True
    version: str = ""
    unix_time_s: Callable[[float], float | None] = lambda _now: None
    has_log: bool = False
    flight: FlightMemory | None = None
    settings_memory: SettingsMemory = field(default_factory=dict[BoardId, Mapping[str, Value]])
