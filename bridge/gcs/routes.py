# SPDX-License-Identifier: GPL-3.0-or-later
"""Routes frames between an autopilot that speaks MAVLink itself and its ground stations, unchanged. Sans-IO.

Routing as MAVLink describes it (https://mavlink.io/en/guide/routing.html): a frame without a target goes to everyone
but its sender; one with a target only to where that system (and component) was heard. Frames for a system that was
not heard yet go to the autopilot.
"""

from collections.abc import Sequence
from itertools import takewhile

from bridge.gcs.cost import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.station import Peer, Station
from bridge.gcs.stations import PRECEDENCE
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MAGIC_V2, MavlinkFrame
from protocols.mavlink.target import has_target_field, target_of

#: Mission Planner, QGroundControl, MAVSDK and MAVProxy read several frames in a datagram; MAVROS cuts at 296 bytes.
MAX_DATAGRAM_SIZE = 280
#: Ids remembered behind one peer: a router may carry a fleet, but made-up ids must not fill the memory.
_MAX_SPEAKERS = 64
#: Messages remembered that have no target: all of one dialect from a few components.
_MAX_KINDS = 1024
#: Carries a signing key in the clear. The guard refuses it from ground stations.
_NEVER_FORWARDED = messages.MAVLINK_MSG_ID_SETUP_SIGNING
_HEARTBEAT = messages.MAVLINK_MSG_ID_HEARTBEAT


class Routes:
    """The routes while one autopilot is on the port."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        self._aboard: set[tuple[int, int]] = set()
        self._heard: dict[Peer, set[tuple[int, int]]] = {}
        #: Messages without a target, by the bytes of the header that hold sender and message id.
        self._for_all: set[bytes] = set()

    def from_autopilot(self, frames: Sequence[MavlinkFrame]) -> None:
        """Send the autopilot's frames on; those that arrived together share datagrams unless one has a target."""
        raws = [frame.raw for frame in frames]
        kinds = [raw[5:10] if raw[0] == MAGIC_V2 else raw[3:6] for raw in raws]
        if self._for_all.issuperset(kinds) or all(map(self._is_for_all, kinds, frames)):
            self._send(raws)
            return
        for frame in frames:
            self._send_alone(frame)

    def addressed(self, system: int, component: int = 0) -> tuple[int, int] | None:
        """The ids on the autopilot's side of the component that a frame is for, or of its system; None: of neither."""
        there = (ids for ids in self._aboard if system in (0, ids[0]))
        return min(there, key=lambda ids: (ids[1] != component, ids), default=None)

    def is_echo(self, frame: MavlinkFrame) -> bool:
        """True for the autopilot's own frame, returned by a router that floods."""
        return frame.sender in self._aboard

    def from_station(self, station: Station, frame: MavlinkFrame, *, to_stations: bool) -> bool:
        """Send a frame that the guard accepted on to other stations; True if it is for the autopilot, too.

        `to_stations` False: it reaches no other station, and its sender is not found by its ids.
        """
        system, component = target_of(frame)
        there = self._ground.everyone() if system == 0 else self._peers_of(system, component)
        others = [peer for peer in there if peer != station.peer]
        if to_stations:
            behind = self._heard.setdefault(station.peer, set())
            if len(behind) < _MAX_SPEAKERS:
                behind.add(frame.sender)
            self._ground.forward([frame.raw], takewhile(lambda _: self._ground.allows(station, Cost.COPIED), others))
        return system == 0 or self.addressed(system) is not None or not others

    def forget(self, peer: Peer) -> None:
        self._heard.pop(peer, None)

    def _peers_of(self, system: int, component: int) -> list[Peer]:
        def is_there(peer: Peer) -> bool:
            behind = self._heard.get(peer, ())
            return any(sysid == system and component in (0, compid) for sysid, compid in behind)

        return [peer for peer in self._ground.stations.peers() if is_there(peer)]

    def _is_for_all(self, kind: bytes, frame: MavlinkFrame) -> bool:
        """Meet a new kind of message from a component aboard; True if it has no target field."""
        if has_target_field(frame.msgid):
            return False
        self._aboard.add(frame.sender)
        if len(self._for_all) < _MAX_KINDS:
            self._for_all.add(kind)
        return True

    def _send_alone(self, frame: MavlinkFrame) -> None:
        self._aboard.add(frame.sender)
        if frame.msgid == _NEVER_FORWARDED:
            return
        system, component = target_of(frame)
        if system == 0:
            self._send([frame.raw])
            return
        self._ground.on_frames([frame.raw])
        self._ground.forward([frame.raw], self._peers_of(system, component))

    def _send(self, frames: list[bytes]) -> None:
        self._ground.on_frames(frames)
        peers = self._ground.everyone()
        if len(peers) > PRECEDENCE and _HEARTBEAT not in (MavlinkFrame(raw).msgid for raw in frames):
            peers = [peer for peer in peers if self._ground.budgets.allows(Cost.FOLLOWED, peer, self._ground.now)]
        self._ground.forward(in_datagrams(frames), peers)


def in_datagrams(frames: Sequence[bytes]) -> list[bytes]:
    """Join frames that arrived together into datagrams of at most 280 bytes: the cost is per datagram, not per byte."""
    joined = b"".join(frames)
    if len(joined) <= MAX_DATAGRAM_SIZE:
        return [joined]
    datagrams: list[bytes] = []
    start = end = 0
    for frame in frames:
        if end + len(frame) > start + MAX_DATAGRAM_SIZE:
            datagrams.append(joined[start:end])
            start = end
        end += len(frame)
    return [*datagrams, joined[start:]]
