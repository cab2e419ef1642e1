# SPDX-License-Identifier: GPL-3.0-or-later
"""What a daemon is started with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M
from bridge.fc.states.port import Autopilot
from service.links.connection import AutoFc, FcAddress, GcsAddress
from service.links.msp_share import ShareSettings
from service.links.write_access import WriteAccess
from service.web.settings import WebSettings
from service.zenoh_link.settings import ZenohSettings

DEFAULT_GCS = "udpin:0.0.0.0:14550"
DEFAULT_SYSID = 1
DEFAULT_LOG_LEVEL = "info"


@dataclass(frozen=True, slots=True)
class TlogLimits:
    """Bytes of one telemetry log (a second's records come on top) and of all together; days for which one is kept."""

    file_size: int = 16 << 20
    total_size: int = 256 << 20
    days: int = 30


class PassThroughRule(Enum):
    """What an autopilot that speaks MAVLink for itself gets over links without a key or a list of writers."""

    MISSIONS = "missions"
    EVERYTHING = "everything"


@dataclass(frozen=True, slots=True)
class Settings:
    """What a daemon is started with. Without `state_dir` nothing is stored; `tlog` None: telemetry is not recorded.

    `access`: who may write over a link, by its address as text; over others everyone may. `zenoh` None: it is not
    joined. `web` None: no status page is served. `log_level`: debug, info, warning or error.
    """

    fc: FcAddress = AutoFc()  # noqa: RUF009  # frozen
    gcs: Sequence[GcsAddress] = ()
    state_dir: Path | None = None
    sysid: int = DEFAULT_SYSID
    takeoff_max_m: int = TAKEOFF_MAX_M
    tlog: TlogLimits | None = None
    record_uart: Path | None = None
    autopilot: Autopilot = Autopilot.AUTO
    pass_through: PassThroughRule = PassThroughRule.MISSIONS
    access: Mapping[str, WriteAccess] = field(default_factory=dict)
    share: Sequence[ShareSettings] = ()
    zenoh: ZenohSettings | None = None
    web: WebSettings | None = None
    log_level: str = DEFAULT_LOG_LEVEL
