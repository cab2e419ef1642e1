# SPDX-License-Identifier: GPL-3.0-or-later
"""The configuration of one bridge."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M
from bridge.controllers.table import PROFILES
from bridge.fc.profile import Profile, RuleSettings
from bridge.gcs.guard import LinkAccess
from bridge.model.autopilot import Autopilot
from bridge.model.flight_memory import FlightMemory
from bridge.model.settings import SealMemory, SealsOfThisRun


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """The configuration of one bridge. `speeds`: of the port, baud; (None,) if it has no speed.

    `version`: of the bridge itself. `unix_time_s`: the time of day at a monotonic time, None if unknown.
    `links`: access rules by link name; every station may write over other links. `passes_everything`: an autopilot
    that speaks MAVLink itself gets commands over those other links, too. `flight`: of the craft that a former bridge
    left armed. `seals`: of the settings of the boards seen before.
    """

    speeds: Sequence[int | None]
    sysid: int = 1
    compid: int = 1
    rules: RuleSettings = field(default_factory=lambda: RuleSettings(TAKEOFF_MAX_M))
    autopilot: Autopilot = Autopilot.AUTO
    profiles: Sequence[Profile] = PROFILES
    links: Mapping[str, LinkAccess] = field(default_factory=dict)
    version: str = ""
    unix_time_s: Callable[[float], float | None] = lambda _now: None
    passes_everything: bool = False
    flight: FlightMemory | None = None
    seals: SealMemory = field(default_factory=SealsOfThisRun)
