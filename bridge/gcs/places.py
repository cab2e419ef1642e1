# SPDX-License-Identifier: GPL-3.0-or-later
"""The places of a link: how many ground stations may be connected, and which one makes room for another."""

from array import array
from collections import Counter, OrderedDict
from collections.abc import Hashable
from zlib import crc32

from bridge.gcs.ground_station import GroundStation
from bridge.gcs.station import Peer

#: As many as a network has hosts whose addresses differ in the last byte.
MAX_PEERS = 256
#: Places for stations that may only read, which so take none from those with the key.
MAX_LISTENERS = 8
#: Places for one host, which may change its ports.
MAX_OF_HOST = 16
#: The number of refused addresses that are remembered: at 20,000 a second, most of them for a second or more.
_REMEMBERED = 1 << 16


class Places:
    """A full link admits a newcomer at its second frame, because forged addresses are used once.

    The station silent for longest, without a budget of its own, then leaves. A full host makes room among its own.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        #: The one silent for longest first: a station that is heard is moved to the end.
        self.stations: OrderedDict[Peer, GroundStation] = OrderedDict()
        self._hosts: Counter[Hashable] = Counter()
        self._turned_away = array("I")

    def has_room_for(self, peer: Peer) -> bool:
        """False if there is no free place, and a newcomer is heard for the first time."""
        if not self._is_full(peer.host):
            return True
        if not self._turned_away:
            self._turned_away = array("I", [0]) * _REMEMBERED
        mark = crc32(repr(peer).encode())
        has_come_before = self._turned_away[mark % _REMEMBERED] == mark
        self._turned_away[mark % _REMEMBERED] = mark
        return has_come_before

    def displaced_by(self, peer: Peer) -> GroundStation | None:
        """The station that must leave if this newcomer takes a place."""
        if not self._is_full(peer.host):
            return None
        if self._hosts[peer.host] >= MAX_OF_HOST:
            of_host = (station for station in self.stations.values() if station.peer.host == peer.host)
            return min(of_host, key=lambda station: station.is_steady)
        return min(self.stations.values(), key=lambda station: station.has_own_budget)

    def add(self, station: GroundStation) -> None:
        self.stations[station.peer] = station
        station.places = self
        self._hosts[station.peer.host] += 1

    def remove(self, station: GroundStation) -> None:
        host = station.peer.host
        del self.stations[station.peer]
        station.places = None
        self._hosts[host] -= 1
        if not self._hosts[host]:
            del self._hosts[host]

    def _is_full(self, host: Hashable) -> bool:
        return len(self.stations) >= self._size or self._hosts[host] >= MAX_OF_HOST
