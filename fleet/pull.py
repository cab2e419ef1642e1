# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the missions of many vehicles."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

import zenoh

from fleet.payload import part, text, whole
from fleet.roll_call import replies_of
from fleet.vehicle import BridgeId
from payloads.keys import MISSION_CURRENT, full
from payloads.mission_data import Json, mission_items
from protocols.mission_item import MissionItem

#: The bridge may have to read the mission first: some seconds at 9600 baud.
_TIMEOUT_S = 15.0


@dataclass(frozen=True, slots=True)
class Held:
    """One vehicle's mission; `error`: why it is not known, with the rest empty."""

    vehicle: str
    items: tuple[MissionItem, ...] = ()
    count: int = 0
    checksum: str = ""
    error: str | None = None


def pull(session: zenoh.Session, prefix: str, names: Collection[str], bridges: Collection[BridgeId]) -> list[Held]:
    """Read the missions; one result per vehicle, in the order of `names`. Replies of storages are ignored."""
    meant = [bridge for bridge in bridges if bridge.vehicle in names]
    used = Counter(bridge.vehicle for bridge in meant)
    # One query to all takes no longer than one to the slowest.
    only = next(iter(names)) if len(names) == 1 else "*"
    replies = replies_of(session, full(prefix, only, MISSION_CURRENT.suffix), meant, _TIMEOUT_S)
    held = {bridge.vehicle: _held(bridge.vehicle, data) for bridge, data in replies.items()}
    for name in names:
        if used[name] > 1:
            held[name] = Held(name, error="several bridges use this name: give each its own (zenoh.vehicle)")
    silent = "no reply: its bridge hangs, or the router's access control denies the query"
    return [held.get(name) or Held(name, error=silent) for name in names]


def _held(name: str, data: Json | None) -> Held:
    if data is None:
        return Held(name, error="this version does not understand its reply")
    count, checksum, items = whole(data, "count"), text(data, "checksum"), part(data, "items")
    if count is None or checksum is None:
        return Held(name, error="its flight controller's mission is not known")
    try:
        return Held(name, tuple(mission_items(items)), count, checksum)
    except ValueError as error:
        return Held(name, error=f"this version does not understand its reply: {error}")
