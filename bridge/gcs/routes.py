# SPDX-License-Identifier: GPL-3.0-or-later
"""Routes frames between an autopilot that speaks MAVLink itself and its ground stations, unchanged. Sans-IO.

Routing as MAVLink describes it (https://mavlink.io/en/guide/routing.html): a frame without a target goes to everyone
except the sender. One with a target only to where that system (and component) was heard. Frames for a system that was
not heard yet go to the autopilot.
"""

from collections.abc import Sequence

from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation
from protocols.mavlink.codec import repack
from protocols.mavlink.dialect import messages
from protocols.mavlink.frame import MavlinkFrame, is_autopilot_heartbeat

#: Messages remembered without a target: all of one dialect from a few components.
_MAX_KINDS = 1024
#: Carries a signing key in the clear. The guard refuses it from ground stations.
_NEVER_FORWARDED = messages.MAVLINK_MSG_ID_SETUP_SIGNING


class Routes:
    """The routes of the autopilot on the port, while there is one."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        self.forget()

    def forget(self) -> None:
        """Begin again with another autopilot."""
        self._aboard: set[tuple[int, int]] = set()
        #: The kinds (protocols.mavlink.frame) of messages without a target, and of the autopilot's heartbeat.
        self._for_all: set[bytes] = set()
        self._heartbeats: set[bytes] = set()

    def from_autopilot(self, frames: Sequence[bytes], kinds: Sequence[bytes]) -> None:
        """Send the autopilot's frames on. Those that arrived together share datagrams unless one has a target."""
        if self._for_all.issuperset(kinds) or all(map(self._is_for_all, kinds, map(MavlinkFrame, frames))):
            self._send(frames)
            if not self._heartbeats.isdisjoint(kinds):
                self._show_heartbeat(frames)
            return
        for frame in map(MavlinkFrame, frames):
            self._send_alone(frame)

    def addressed(self, system: int, component: int = 0) -> tuple[int, int] | None:
        """The ids on the autopilot's side of the component that a frame is for, or of the system, else None."""
        there = (ids for ids in self._aboard if system in (0, ids[0]))
        return min(there, key=lambda ids: (ids[1] != component, ids), default=None)

    def is_echo(self, frame: MavlinkFrame) -> bool:
        """True for the autopilot's own frame, returned by a router that floods."""
        return frame.sender in self._aboard

    def from_station(self, station: GroundStation, frame: MavlinkFrame, *, to_stations: bool) -> bool:
        """Send an accepted frame on to other stations. Returns True if it is also for the autopilot.

        `to_stations`: False if it does not reach any other station.
        """
        system, component = frame.target
        there = self._ground.everyone if system == 0 else self._stations_of(system, component)
        others = [other for other in there if other is not station]
        if to_stations:
            self._ground.outbox.forward([frame.raw], others)
        return system == 0 or self.addressed(system) is not None or not others

    def _stations_of(self, system: int, component: int) -> list[GroundStation]:
        """The stations with these ids. One that may only read is not found by the ids, which may be the pilot's."""

        def is_there(station: GroundStation) -> bool:
            return any(sysid == system and component in (0, compid) for sysid, compid in station.senders)

        return [station for station in self._ground.everyone if station.rights.stations and is_there(station)]

    def _is_for_all(self, kind: bytes, frame: MavlinkFrame) -> bool:
        """Meet a new kind of message from a component aboard, or True if it lacks a target field."""
        if frame.has_target_field:
            return False
        self._aboard.add(frame.sender)
        if len(self._for_all) < _MAX_KINDS:
            self._for_all.add(kind)
            if is_autopilot_heartbeat(frame):
                self._heartbeats.add(kind)
        return True

    def _show_heartbeat(self, frames: Sequence[bytes]) -> None:
        for frame in filter(is_autopilot_heartbeat, map(MavlinkFrame, frames)):
            if (heartbeat := repack(frame)) is not None:
                self._ground.outbox.heartbeat = frame.sender, heartbeat

    def _send_alone(self, frame: MavlinkFrame) -> None:
        self._aboard.add(frame.sender)
        if frame.msgid == _NEVER_FORWARDED:
            return
        system, component = frame.target
        if system == 0:
            self._send([frame.raw])
            return
        self._record([frame.raw])
        self._ground.outbox.forward([frame.raw], self._stations_of(system, component))

    def _send(self, frames: Sequence[bytes]) -> None:
        self._record(frames)
        self._ground.outbox.forward(frames, self._ground.everyone)

    def _record(self, frames: Sequence[bytes]) -> None:
        if self._ground.outbox.recorded is not None:
            self._ground.outbox.recorded += frames
