# SPDX-License-Identifier: GPL-3.0-or-later
"""Every key of a vehicle, in one table; docs/zenoh.md has the same.

A key is `<prefix>/<vehicle>/<suffix>`: the prefix comes first, so that `fleet/*/v1/state` selects a whole fleet. The
version is part of each suffix, so that a subscriber of version 1 never gets a payload that it would misread. A wildcard
does not match a verbatim chunk (@), so a recorder of `fleet/**` does not become a MAVLink ground station, and a command
is refused unless the query names it in full.
"""

from dataclasses import dataclass
from enum import Enum

from reports.vehicle_groups import Group

#: The version of keys and payloads. A new field does not change it. A change that would mislead a reader raises it.
VERSION = 1
_V = f"v{VERSION}"


class SampleDelivery(Enum):
    """The quality of service of a sample."""

    DROP = "dropped rather than delayed"
    RELIABLE = "reliable"
    REPLY = "a reply to a query"


@dataclass(frozen=True, slots=True)
class ZenohKey:
    """One key. `schema`: file name below schemas/, without its suffix, or None if the payload is raw MAVLink.

    `kept`: the number of samples kept for subscribers that lost some, or 0 if there is none.
    """

    suffix: str
    schema: str | None
    delivery: SampleDelivery
    kept: int = 0

    @property
    def is_published(self) -> bool:
        return self.delivery is not SampleDelivery.REPLY and self is not MAVLINK_IN

    @property
    def is_command(self) -> bool:
        return self in COMMAND_KEYS


TELEMETRY = {group: ZenohKey(f"{_V}/telemetry/{group.value}", group.value, SampleDelivery.DROP) for group in Group}
STATE = ZenohKey(f"{_V}/state", "state", SampleDelivery.DROP, kept=1)
OVERVIEW = ZenohKey(f"{_V}/overview", "overview", SampleDelivery.DROP)
EVENT = ZenohKey(f"{_V}/event", "event", SampleDelivery.RELIABLE, kept=256)
MISSION_CURRENT = ZenohKey(f"{_V}/mission/current", "mission_current", SampleDelivery.RELIABLE, kept=1)
MISSION_LIST = ZenohKey(f"{_V}/mission/list", "mission_list", SampleDelivery.REPLY)
MISSION_REPORT = ZenohKey(f"{_V}/mission/report", "mission_report", SampleDelivery.RELIABLE, kept=16)
MAVLINK_OUT = ZenohKey(f"@mavlink/{_V}/out", None, SampleDelivery.DROP)
MAVLINK_IN = ZenohKey(f"@mavlink/{_V}/in", None, SampleDelivery.RELIABLE)
#: More than a datagram of any link holds. Larger samples of these two are not MAVLink.
MAX_MAVLINK_BYTES = 2048


COMMANDS = f"@cmd/{_V}"


def _command(name: str) -> ZenohKey:
    return ZenohKey(f"{COMMANDS}/{name}", "command_reply", SampleDelivery.REPLY)


UPLOAD = _command("mission/upload")
CHECK = _command("mission/check")
CLEAR = _command("mission/clear")
STATUS = _command("status")
SETTINGS_LIST = _command("settings/list")
SETTINGS_PLAN = _command("settings/plan")
SETTINGS_RESTORE = _command("settings/restore")
LOG_LIST = _command("log/list")
LOG_READ = _command("log/read")
COMMAND_KEYS = (
    *(UPLOAD, CHECK, CLEAR, STATUS),
    *(SETTINGS_LIST, SETTINGS_PLAN, SETTINGS_RESTORE),
    *(LOG_LIST, LOG_READ),
)

KEYS = (
    *TELEMETRY.values(),
    STATE,
    OVERVIEW,
    EVENT,
    MISSION_CURRENT,
    MISSION_LIST,
    MISSION_REPORT,
    MAVLINK_OUT,
    MAVLINK_IN,
    *COMMAND_KEYS,
)

#: A liveliness token: <prefix>/<vehicle>/v1/alive/<session id>.
ALIVE = f"{_V}/alive"


def full(prefix: str, vehicle: str, suffix: str) -> str:
    return f"{prefix}/{vehicle}/{suffix}"


def vehicle_in(key: object) -> str:
    return str(key).split("/")[1]
