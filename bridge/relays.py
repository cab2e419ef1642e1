# SPDX-License-Identifier: GPL-3.0-or-later
"""Several vehicles behind slow links at the same ground stations: each frame goes to the vehicle that it addresses.

Sans-IO, like the Relay of each vehicle.
"""

from dataclasses import dataclass
from math import inf

from bridge.gcs.station import Peer
from bridge.relay import MISSION_REQUESTS, Relay, RelayEffect
from protocols.mavlink.frame import MavlinkFrame, MavlinkSplitter


@dataclass(frozen=True, slots=True)
class SameSystem:
    """An effect: a vehicle is left out, because another has the system id."""

    other: str
    system: int


class Relays:
    """The relays by the names of their vehicles. Ground stations know vehicles by system id alone."""

    def __init__(self) -> None:
        self._left_out: list[tuple[str, SameSystem]] = []
        self._relays: dict[str, Relay] = {}
        self._names: dict[int, str] = {}
        self._peers: dict[Peer, bool] = {}
        self._splitters: dict[Peer, MavlinkSplitter] = {}

    def add(self, name: str, relay: Relay) -> None:
        for peer, until_answered in self._peers.items():
            relay.add_default_peer(peer, until_answered=until_answered)
        self._relays[name] = relay

    def remove(self, name: str) -> None:
        """Forget a vehicle, for example because it has left."""
        self._relays.pop(name, None)
        self._names = {system: each for system, each in self._names.items() if each != name}

    @property
    def heard(self) -> set[str]:
        """The vehicles that were heard, without those left out."""
        return set(self._names.values())

    @property
    def due(self) -> float:
        """The time of the next `tick`."""
        return min((relay.due for relay in self._relays.values()), default=inf)

    def tick(self, now: float) -> None:
        for relay in self._relays.values():
            if now >= relay.due:
                relay.tick(now)

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        self._peers[peer] = until_answered
        for relay in self._relays.values():
            relay.add_default_peer(peer, until_answered=until_answered)

    def remove_default_peer(self, peer: Peer) -> None:
        self._peers.pop(peer, None)
        for relay in self._relays.values():
            relay.remove_default_peer(peer)

    def gcs_received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> None:
        """Handle bytes from a ground station: frames for one vehicle, and those for all, such as heartbeats."""
        frames = (MavlinkSplitter() if datagram else self._splitters.setdefault(peer, MavlinkSplitter())).feed(data)
        for name, relay in self._relays.items():
            own = [frame.raw for frame in frames if self._addresses(frame, name)]
            if own:
                relay.gcs_received(peer, b"".join(own), now, datagram=datagram)

    def gcs_gone(self, peer: Peer, now: float) -> None:
        self._splitters.pop(peer, None)
        for relay in self._relays.values():
            relay.gcs_gone(peer, now)

    def vehicle_received(self, name: str, data: bytes, now: float) -> None:
        """Pass on frames of a vehicle."""
        relay = self._relays.get(name)
        if relay is None:
            return
        relay.vehicle_received(data, now)
        system = relay.system
        if system is None or (other := self._names.setdefault(system, name)) == name:
            return
        self.remove(name)
        self._left_out.append((name, SameSystem(other, system)))

    def take(self) -> list[tuple[str, RelayEffect | SameSystem]]:
        """What is to be done since the last call, by vehicle."""
        left_out, self._left_out = self._left_out, []
        return [*((name, effect) for name, relay in self._relays.items() for effect in relay.take()), *left_out]

    def _addresses(self, frame: MavlinkFrame, name: str) -> bool:
        system, _ = frame.target
        if len(self._relays) == 1:
            return True
        if system == 0:
            # A mission belongs to one vehicle: to clear those of all could only be a mistake.
            return frame.msgid not in MISSION_REQUESTS
        return self._names.get(system) == name
