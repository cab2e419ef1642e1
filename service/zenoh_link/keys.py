# SPDX-License-Identifier: GPL-3.0-or-later
"""Every key of a vehicle, in one table: docs/zenoh.md shows the same one.

A key is `<prefix>/<vehicle>/<suffix>`: the prefix comes first, so that `fleet/*/state` takes a whole fleet.
"""

from dataclasses import dataclass
from enum import Enum

from bridge.model.vehicle_groups import Group

#: The version of keys and payloads. One that a reader of this version would misread gets another.
VERSION = 1
#: A verbatim chunk: no wildcard of a subscriber or a query matches it, so nobody sends a command by accident.
COMMANDS = f"@cmd/v{VERSION}"


class SampleDelivery(Enum):
    """What becomes of a sample that cannot go at once: it is dropped, or waits on the session's thread."""

    DROP = "dropped rather than waited for"
    RELIABLE = "reliable"
    REPLY = "a reply to a query"


@dataclass(frozen=True, slots=True)
class ZenohKey:
    """One key. `schema`: file name below schemas/, without its ending; None: the payload is raw MAVLink."""

    suffix: str
    schema: str | None
    delivery: SampleDelivery


TELEMETRY = {group: ZenohKey(f"telemetry/{group.value}", group.value, SampleDelivery.DROP) for group in Group}
STATE = ZenohKey("state", "state", SampleDelivery.DROP)
EVENT = ZenohKey("event", "event", SampleDelivery.RELIABLE)
MISSION_CURRENT = ZenohKey("mission/current", "mission_current", SampleDelivery.RELIABLE)
MISSION_LIST = ZenohKey("mission/list", "mission_list", SampleDelivery.REPLY)
MISSION_REPORT = ZenohKey("mission/report", "mission_report", SampleDelivery.RELIABLE)
MAVLINK_OUT = ZenohKey("mavlink/out", None, SampleDelivery.DROP)
MAVLINK_IN = ZenohKey("mavlink/in", None, SampleDelivery.RELIABLE)

UPLOAD = ZenohKey(f"{COMMANDS}/mission/upload", "command_reply", SampleDelivery.REPLY)
CHECK = ZenohKey(f"{COMMANDS}/mission/check", "command_reply", SampleDelivery.REPLY)
CLEAR = ZenohKey(f"{COMMANDS}/mission/clear", "command_reply", SampleDelivery.REPLY)
RESTORE = ZenohKey(f"{COMMANDS}/mission/restore", "command_reply", SampleDelivery.REPLY)
STATUS = ZenohKey(f"{COMMANDS}/status", "command_reply", SampleDelivery.REPLY)
COMMAND_KEYS = (UPLOAD, CHECK, CLEAR, RESTORE, STATUS)

KEYS = (
    *TELEMETRY.values(),
    STATE,
    EVENT,
    MISSION_CURRENT,
    MISSION_LIST,
    MISSION_REPORT,
    MAVLINK_OUT,
    MAVLINK_IN,
    *COMMAND_KEYS,
)

#: A liveliness token: <prefix>/<vehicle>/alive/<session id>.
ALIVE = "alive"


def full(prefix: str, vehicle: str, suffix: str) -> str:
    """Return a key's whole name."""
    return f"{prefix}/{vehicle}/{suffix}"
