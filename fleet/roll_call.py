# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicles that are alive, and their states: one query to the whole fleet."""

from collections.abc import Collection
from queue import SimpleQueue

import zenoh

from fleet.payload import decode
from fleet.session import FleetError, send_query
from fleet.vehicle import BridgeId, FleetVehicle, as_fleet, bridge_of, in_order, replier, vehicle_of
from payloads.keys import ALIVE, STATE, full
from payloads.mission_data import Json

#: After this a bridge without a reply is shown as not answering.
_TIMEOUT_S = 2.0


def alive(session: zenoh.Session, prefix: str) -> set[BridgeId]:
    """The bridges that have a liveliness token."""
    replies = list(session.liveliness().get(full(prefix, "*", f"{ALIVE}/*"), timeout=_TIMEOUT_S))
    if any(reply.err is not None for reply in replies):
        # zenoh's own error, a timeout: an empty list would be wrong.
        raise FleetError(
            f"the router did not list the vehicles within {_TIMEOUT_S:.0f} s: it hangs, or the connection is bad"
        )
    samples = [reply.ok for reply in replies if reply.ok is not None]
    return {bridge for sample in samples if (bridge := bridge_of(str(sample.key_expr), prefix)) is not None}


def roll_call(session: zenoh.Session, prefix: str) -> list[FleetVehicle]:
    """The fleet by name. Takes as long as the slowest bridge, two seconds at most."""
    bridges = alive(session, prefix)
    states = replies_of(session, full(prefix, "*", STATE.suffix), bridges, _TIMEOUT_S)
    return as_fleet(vehicle_of(bridge, states.get(bridge)) for bridge in bridges)


def replies_of(
    session: zenoh.Session, selector: str, bridges: Collection[BridgeId], timeout_s: float
) -> dict[BridgeId, Json | None]:
    """These bridges' replies, None if unreadable. Ends when all have replied. Replies of storages are ignored."""
    found: dict[BridgeId, Json | None] = {}
    if not bridges:
        return found
    replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
    send_query(session, selector, replies.put, timeout_s)
    for reply in iter(replies.get, None):
        bridge = replier(reply)
        if reply.ok is not None and bridge is not None and bridge in bridges:
            found[bridge] = decode(reply.ok)
            if len(found) == len(bridges):
                break
    return found


def chosen(bridges: set[BridgeId], names: tuple[str, ...], prefix: str) -> list[str]:
    """The names to use: the given ones, or all; FleetError if one is not alive."""
    there = sorted({bridge.vehicle for bridge in bridges}, key=in_order)
    if not there:
        raise FleetError(f"no vehicle is alive under {prefix!r}: is naze-bridge running there, with this prefix?")
    for name in names:
        if name not in there:
            raise FleetError(f"no vehicle {name!r} is alive; there {_are(there)}")
    return list(dict.fromkeys(names)) or there


def _are(names: list[str]) -> str:
    return f"is {names[0]}" if len(names) == 1 else f"are {', '.join(names)}"
