# SPDX-License-Identifier: GPL-3.0-or-later
"""Every key of a vehicle, in one table; docs/zenoh.md has the same one.

A key is `<prefix>/<vehicle>/<suffix>`: the prefix comes first, so that `fleet/*/v1/state` selects a whole fleet. The
version is part of each suffix, so that a subscriber of version 1 never gets a payload that it would misread.
"""

from dataclasses import dataclass
from enum import Enum

from bridge.model.vehicle_groups import Group

#: The version of keys and payloads. A new field does not change it; a change that would mislead a reader raises it.
VERSION = 1
_V = f"v{VERSION}"
#: Verbatim chunks (@) match no wildcard: a wildcard never sends a command, and a recorder of `fleet/**` does not become
#: a MAVLink ground station.
COMMANDS = f"@cmd/{_V}"
MAVLINK = f"@mavlink/{_V}"


class SampleDelivery(Enum):
    """The quality of service of a sample."""

    DROP = "dropped rather than delayed"
    RELIABLE = "reliable"
    REPLY = "a reply to a query"


@dataclass(frozen=True, slots=True)
class ZenohKey:
    """One key. `schema`: file name below schemas/, without its suffix; None: the payload is raw MAVLink.

    `kept`: the number of samples kept for subscribers that lost some; 0: none. `is_compact`: CBOR in any case,
    and the time in whole seconds.
    """

    suffix: str
    schema: str | None
    delivery: SampleDelivery
    kept: int = 0
    is_compact: bool = False

    @property
    def is_published(self) -> bool:
        """True if the vehicle puts samples at this key."""
        return self.delivery is not SampleDelivery.REPLY and self is not MAVLINK_IN


TELEMETRY = {group: ZenohKey(f"{_V}/telemetry/{group.value}", group.value, SampleDelivery.DROP) for group in Group}
STATE = ZenohKey(f"{_V}/state", "state", SampleDelivery.DROP, kept=1)
OVERVIEW = ZenohKey(f"{_V}/overview", "overview", SampleDelivery.DROP, is_compact=True)
EVENT = ZenohKey(f"{_V}/event", "event", SampleDelivery.RELIABLE, kept=256)
HISTORY = ZenohKey(f"{_V}/history", "history", SampleDelivery.REPLY)
MISSION_CURRENT = ZenohKey(f"{_V}/mission/current", "mission_current", SampleDelivery.RELIABLE, kept=1)
MISSION_LIST = ZenohKey(f"{_V}/mission/list", "mission_list", SampleDelivery.REPLY)
MISSION_REPORT = ZenohKey(f"{_V}/mission/report", "mission_report", SampleDelivery.RELIABLE, kept=16)
MAVLINK_OUT = ZenohKey(f"{MAVLINK}/out", None, SampleDelivery.DROP)
MAVLINK_IN = ZenohKey(f"{MAVLINK}/in", None, SampleDelivery.RELIABLE)

UPLOAD = ZenohKey(f"{COMMANDS}/mission/upload", "command_reply", SampleDelivery.REPLY)
CHECK = ZenohKey(f"{COMMANDS}/mission/check", "command_reply", SampleDelivery.REPLY)
CLEAR = ZenohKey(f"{COMMANDS}/mission/clear", "command_reply", SampleDelivery.REPLY)
RESTORE = ZenohKey(f"{COMMANDS}/mission/restore", "command_reply", SampleDelivery.REPLY)
STATUS = ZenohKey(f"{COMMANDS}/status", "command_reply", SampleDelivery.REPLY)
RATES = ZenohKey(f"{COMMANDS}/rates", "command_reply", SampleDelivery.REPLY)
COMMAND_KEYS = (UPLOAD, CHECK, CLEAR, RESTORE, STATUS, RATES)

KEYS = (
    *TELEMETRY.values(),
    STATE,
    OVERVIEW,
    EVENT,
    HISTORY,
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
    """The full key."""
    return f"{prefix}/{vehicle}/{suffix}"


def vehicle_in(key: object) -> str:
    """The vehicle's name in a full key."""
    return str(key).split("/")[1]
