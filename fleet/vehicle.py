# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle of the fleet, made from an `overview` or a `state`."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import zenoh

from fleet.payload import flag, number, text, whole
from payloads.keys import ALIVE, vehicle_in
from payloads.mission_data import Json
from payloads.names import ZenohSettingsError, check_name


@dataclass(frozen=True, slots=True, order=True)
class BridgeId:
    """A bridge that is alive: the vehicle's name, and zenoh's id of the session, unique to a bridge."""

    vehicle: str
    session_id: str


@dataclass(frozen=True, slots=True)
class FleetVehicle:
    """The known data of one vehicle, or None if unknown.

    `answers`: True if it was heard. `bridges`: how many use this name, normally 1.
    """

    name: str
    session_id: str
    answers: bool = False
    bridges: int = 1
    protocol: str | None = None
    armed: bool | None = None
    mode: str | None = None
    battery_v: float | None = None
    lat_deg: float | None = None
    lon_deg: float | None = None
    height_m: float | None = None
    heading_deg: float | None = None
    speed_m_s: float | None = None
    fix: str | None = None
    mission_count: int | None = None
    mission_checksum: str | None = None
    mission_state: str | None = None


def bridge_of(key: str, prefix: str) -> BridgeId | None:
    """The bridge that a liveliness token's key belongs to, or None for other keys."""
    match key.split("/"):
        case [first, name, *middle, session_id] if first == prefix and "/".join(middle) == ALIVE:
            try:
                check_name("the name", name)
            except ZenohSettingsError:
                return None
            return BridgeId(name, session_id)
    return None


def replier(reply: zenoh.Reply) -> BridgeId | None:
    """The bridge that sent a reply: the key names the vehicle, the sender the session. None for a storage."""
    if reply.ok is None or reply.replier_id is None:
        return None
    return BridgeId(vehicle_in(reply.ok.key_expr), str(reply.replier_id.zid))


def vehicle_of(bridge: BridgeId, state: Json | None) -> FleetVehicle:
    """Make a vehicle from the payload of its `state` (payloads.overview.state_of for an overview); None: not heard."""
    if state is None:
        return FleetVehicle(bridge.vehicle, bridge.session_id)
    return FleetVehicle(
        bridge.vehicle,
        bridge.session_id,
        answers=True,
        protocol=text(state, "link", "state"),
        armed=flag(state, "status", "armed"),
        mode=text(state, "status", "mode"),
        battery_v=number(state, "battery", "voltage_v"),
        lat_deg=number(state, "position", "lat_deg"),
        lon_deg=number(state, "position", "lon_deg"),
        height_m=number(state, "position", "height_m"),
        heading_deg=number(state, "attitude", "heading_deg"),
        speed_m_s=number(state, "gps", "ground_speed_m_s"),
        fix=text(state, "gps", "fix"),
        mission_count=whole(state, "mission", "count"),
        mission_checksum=text(state, "mission", "checksum"),
        mission_state=text(state, "mission", "state"),
    )


def as_fleet(vehicles: Iterable[FleetVehicle]) -> list[FleetVehicle]:
    """Sort vehicles by name, and count the bridges per name."""
    found = list(vehicles)
    bridges = Counter(vehicle.name for vehicle in found)
    counted = [replace(each, bridges=bridges[each.name]) if bridges[each.name] > 1 else each for each in found]
    return sorted(counted, key=lambda vehicle: (in_order(vehicle.name), vehicle.session_id))


def in_order(name: str) -> list[tuple[int, str]]:
    """A sort key with numbers by their value: naze-2 comes before naze-10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]
