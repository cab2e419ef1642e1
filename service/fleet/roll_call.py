# SPDX-License-Identifier: GPL-3.0-or-later
"""Who is alive, and how each one is: one question to the whole fleet."""

import zenoh

from service.fleet.payload import decode_reply
from service.fleet.session import FleetError, ask
from service.fleet.vehicle import BridgeState, Vehicle, as_fleet, bridge_of, replier, vehicle_of
from service.mission_data import Json
from service.zenoh_link.keys import ALIVE, STATE, full

#: A bridge that has not told its state by then is shown as one that does not answer.
_PATIENCE_S = 2.0


def alive(session: zenoh.Session, prefix: str) -> set[BridgeState]:
    """Return the bridges whose liveliness tokens are there."""
    replies = list(session.liveliness().get(full(prefix, "*", f"{ALIVE}/*"), timeout=_PATIENCE_S))
    if any(reply.err is not None for reply in replies):
        # zenoh's own error, when time is over: an empty list would be a lie.
        raise FleetError(f"the router did not say within {_PATIENCE_S:.0f} s who is alive: it hangs, or the way is bad")
    samples = [reply.ok for reply in replies if reply.ok is not None]
    return {bridge for sample in samples if (bridge := bridge_of(str(sample.key_expr), prefix)) is not None}


def roll_call(session: zenoh.Session, prefix: str) -> list[Vehicle]:
    """Return the fleet by name. Takes as long as the slowest bridge, two seconds at most."""
    bridges = alive(session, prefix)
    states: dict[BridgeState, Json] = {}
    # None to hear, nothing to wait for.
    if bridges:
        for reply in ask(session, full(prefix, "*", STATE.suffix), timeout_s=_PATIENCE_S):
            state, bridge = decode_reply(reply), replier(reply)
            if state is not None and bridge in bridges:
                states[bridge] = state
                if len(states) == len(bridges):
                    break
    return as_fleet(vehicle_of(bridge, states.get(bridge)) for bridge in bridges)


def chosen(bridges: set[BridgeState], names: tuple[str, ...], prefix: str) -> list[str]:
    """Return the names of the vehicles that are meant, all if none is named; FleetError if one is not there."""
    there = sorted({bridge.vehicle for bridge in bridges})
    if not there:
        raise FleetError(f"no vehicle is alive under {prefix!r}: is naze-bridge running there, with this prefix?")
    for name in names:
        if name not in there:
            raise FleetError(f"no vehicle {name!r} is alive; there {_are(there)}")
    return list(dict.fromkeys(names)) or there


def _are(names: list[str]) -> str:
    return f"is {names[0]}" if len(names) == 1 else f"are {', '.join(names)}"
