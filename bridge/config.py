# SPDX-License-Identifier: GPL-3.0-or-later
"""How one bridge is set up."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M
from bridge.controllers.table import PROFILES
from bridge.fc.profile import Profile
from bridge.fc.states.port import Autopilot
from bridge.gcs.guard import LinkAccess


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """How one bridge is set up. `speeds`: what the port may run at, (None,) where it has no speed.

    `version`: of the bridge itself. `unix_time_s`: the time of day at a monotonic time, None if unknown.
    `links`: who may write over which link, by its name; over others everyone may. `passes_everything`: an autopilot
    that speaks MAVLink for itself gets commands over those others, too.
    """

    speeds: Sequence[int | None]
    sysid: int = 1
    compid: int = 1
    takeoff_max_m: int = TAKEOFF_MAX_M
    autopilot: Autopilot = Autopilot.AUTO
    profiles: Sequence[Profile] = PROFILES
    links: Mapping[str, LinkAccess] = field(default_factory=dict)
    version: str = ""
    unix_time_s: Callable[[float], float | None] = lambda _now: None
    passes_everything: bool = False
