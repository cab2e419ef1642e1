# SPDX-License-Identifier: GPL-3.0-or-later
"""Every key of a vehicle, in one table: docs/zenoh.md shows the same one.

A key is `<prefix>/<vehicle>/<suffix>`: the prefix comes first, so that `fleet/*/state` takes a whole fleet.
"""

from dataclasses import dataclass
from enum import Enum

from bridge.vehicle_groups import Group

#: The version of keys and payloads. One that a reader of this version would misread gets another.
VERSION = 1
#: A verbatim chunk: no wildcard of a subscriber or a query matches it, so nobody sends a command by accident.
COMMANDS = f"@cmd/v{VERSION}"


class Delivery(Enum):
    """What becomes of a sample that cannot go at once: it is dropped, or waits on the session's thread."""

    DROP = "dropped rather than waited for"
    RELIABLE = "reliable"
    REPLY = "a reply to a query"


@dataclass(frozen=True, slots=True)
class Key:
    """One key. `schema`: file name below schemas/, without its ending; None: the payload is raw MAVLink."""

    suffix: str
    schema: str | None
    delivery: Delivery


TELEMETRY = {group: Key(f"telemetry/{group.value}", group.value, Delivery.DROP) for group in Group}
STATE = Key("state", "state", Delivery.DROP)
EVENT = Key("event", "event", Delivery.RELIABLE)
MISSION_CURRENT = Key("mission/current", "mission_current", Delivery.RELIABLE)
MISSION_LIST = Key("mission/list", "mission_list", Delivery.REPLY)
MISSION_REPORT = Key("mission/report", "mission_report", Delivery.RELIABLE)
MAVLINK_OUT = Key("mavlink/out", None, Delivery.DROP)
MAVLINK_IN = Key("mavlink/in", None, Delivery.RELIABLE)

UPLOAD = Key(f"{COMMANDS}/mission/upload", "command_reply", Delivery.REPLY)
CHECK = Key(f"{COMMANDS}/mission/check", "command_reply", Delivery.REPLY)
CLEAR = Key(f"{COMMANDS}/mission/clear", "command_reply", Delivery.REPLY)
RESTORE = Key(f"{COMMANDS}/mission/restore", "command_reply", Delivery.REPLY)
STATUS = Key(f"{COMMANDS}/status", "command_reply", Delivery.REPLY)
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
