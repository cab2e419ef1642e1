# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a daemon."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from pathlib import Path

from bridge.controllers.harakiri.rules import TAKEOFF_MAX_M
from bridge.model.autopilot import Autopilot
from service.settings.addresses import AutoFc, FcAddress, GcsAddress
from service.settings.share import ShareSettings
from service.settings.web import WebSettings
from service.settings.write_access import WriteAccess
from service.settings.zenoh import ZenohSettings

DEFAULT_GCS = "udpin:0.0.0.0:14550"


class LogLevel(StrEnum):
    """From the least to the most important."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class TlogLimits:
    """Bytes per telemetry log (plus up to a second's records) and for all together; days that one is kept."""

    file_size: int = 16 << 20
    total_size: int = 256 << 20
    days: int = 30


class PassThroughRule(Enum):
    """The messages that an autopilot in pass-through gets over links without a key or a list of writers."""

    MISSIONS = "missions"
    EVERYTHING = "everything"


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a daemon. Without `state_dir` nothing is stored; `tlog` None: telemetry is not recorded.

    `access`: write permission per link, by its address as text; links not in it are open. `zenoh` None: not used.
    `web` None: no status page.
    """

    fc: FcAddress = AutoFc()  # noqa: RUF009  # frozen
    gcs: Sequence[GcsAddress] = ()
    state_dir: Path | None = None
    sysid: int = 1
    takeoff_max_m: int = TAKEOFF_MAX_M
    tlog: TlogLimits | None = None
    record_uart: Path | None = None
    autopilot: Autopilot = Autopilot.AUTO
    pass_through: PassThroughRule = PassThroughRule.MISSIONS
    access: Mapping[str, WriteAccess] = field(default_factory=dict)
    share: Sequence[ShareSettings] = ()
    zenoh: ZenohSettings | None = None
    web: WebSettings | None = None
    log_level: LogLevel = LogLevel.INFO
