# SPDX-License-Identifier: GPL-3.0-or-later
"""The vehicles that are alive, and their overviews: one query to the whole fleet."""

from collections.abc import Collection
from contextlib import suppress
from queue import Empty, SimpleQueue
from string import hexdigits
from time import monotonic

import zenoh

from fleet.payload import decode
from fleet.session import FleetError, send_query
from fleet.vehicle import BridgeId, FleetVehicle, as_fleet, bridge_of, in_order, replier, vehicle_of
from payloads.keys import ALIVE, OVERVIEW, full
from payloads.mission_data import Json
from payloads.overview import state_of

#: A router that is silent for this long does not answer.
_TIMEOUT_S = 5.0
#: When none of the missing replies has arrived for this long, their bridges are shown as not answering.
_PAUSE_S = 2.0
#: The replies of a large fleet may take this many pauses.
_PAUSES = 15


def alive(session: zenoh.Session, prefix: str, *more: zenoh.Session) -> set[BridgeId]:
    """The bridges that have a liveliness token. Raises FleetError if the router does not list all.

    `more`: sessions to share a large fleet with. zenoh compares each token that a session lists with all before, so
    one alone takes 4 s for 10,000 vehicles.
    """
    replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
    sessions = (session, *more)
    parts = [f"$*{digit}" for digit in hexdigits[:16]] if more else ["*"]
    for place, part in enumerate(parts):
        take = zenoh.handlers.Callback(replies.put, lambda: replies.put(None), indirect=False)
        tokens = full(prefix, "*", f"{ALIVE}/{part}")
        sessions[place % len(sessions)].liveliness().get(tokens, take, timeout=_TIMEOUT_S * _PAUSES)
    found, running = set(), len(parts)
    with suppress(Empty):
        while running:
            reply = replies.get(timeout=_TIMEOUT_S)
            if reply is None:
                running -= 1
            elif reply.ok is None:
                break
            else:
                found.add(bridge_of(str(reply.ok.key_expr), prefix))
        else:
            return {bridge for bridge in found if bridge is not None}
    # zenoh's own error, or a pause: a shorter list would be wrong.
    raise FleetError(
        f"the router did not list the vehicles within {_TIMEOUT_S:.0f} s: it hangs, or the connection is bad"
    )


def roll_call(session: zenoh.Session, prefix: str, *more: zenoh.Session) -> list[FleetVehicle]:
    """The fleet by name. Ends two seconds after the last reply, or when all have replied. `more`: see `alive`."""
    bridges = alive(session, prefix, *more)
    found = replies_of(session, full(prefix, "*", OVERVIEW.suffix), bridges, _PAUSE_S)
    overviews = ((bridge, found.get(bridge)) for bridge in bridges)
    return as_fleet(vehicle_of(bridge, overview and state_of(overview)) for bridge, overview in overviews)


def replies_of(
    session: zenoh.Session, selector: str, bridges: Collection[BridgeId], pause_s: float
) -> dict[BridgeId, Json | None]:
    """These bridges' replies, None if unreadable. Replies of storages are ignored.

    Ends when all have replied, or when no further bridge has replied for `pause_s`.
    """
    found: dict[BridgeId, Json | None] = {}
    if not bridges:
        return found
    replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
    send_query(session, selector, replies.put, pause_s * _PAUSES)
    ends_at = monotonic() + pause_s
    with suppress(Empty):
        while len(found) < len(bridges) and (reply := replies.get(timeout=max(0.0, ends_at - monotonic()))) is not None:
            bridge = replier(reply)
            if reply.ok is not None and bridge is not None and bridge in bridges:
                ends_at = ends_at if bridge in found else monotonic() + pause_s
                found[bridge] = decode(reply.ok)
    return found


def chosen(bridges: set[BridgeId], names: tuple[str, ...], prefix: str) -> list[str]:
    """The names to use: those given, or all. Raises FleetError if one is not alive."""
    there = sorted({bridge.vehicle for bridge in bridges}, key=in_order)
    if not there:
        raise FleetError(f"no vehicle is alive under {prefix!r}: is naze-bridge running there, with this prefix?")
    for name in names:
        if name not in there:
            raise FleetError(f"no vehicle {name!r} is alive; there {_are(there)}")
    return list(dict.fromkeys(names)) or there


def _are(names: list[str]) -> str:
    return f"is {names[0]}" if len(names) == 1 else f"are {', '.join(names)}"
