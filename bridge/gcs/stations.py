# SPDX-License-Identifier: GPL-3.0-or-later
"""The connected ground stations, and the MAVLink version for each."""

from array import array
from collections import Counter, OrderedDict
from collections.abc import Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from operator import itemgetter
from zlib import crc32

from bridge.gcs.station import Peer, Station

#: A UDP peer that is silent for this long has left; a TCP peer leaves with its connection.
EXPIRY_S = 60.0
#: The same for a peer whose ids have all moved to another address, as after Wi-Fi roaming.
MOVED_S = 5.0
#: After such a silence a station may have been restarted: all send a heartbeat each second.
_RETURNS_S = 3.0
#: The minimum interval between searches for silent peers.
_EXPIRY_INTERVAL_S = 1.0
#: Peers on one link: as many as a network has hosts whose addresses differ in the last byte.
MAX_PEERS = 256
#: The number of these that have precedence.
PRECEDENCE = 16
#: The same for peers that may only read, so that they take no slot from those with the key.
MAX_LISTENERS = 8
#: A peer is steady once it has been heard this often, with pauses of at least `_BEAT_S`, like heartbeats at 1 Hz.
_STEADY_BEATS = 3
_BEAT_S = 0.7
#: The number of refused addresses that a full link remembers: at 20,000 a second, most of them for a second or more.
_REMEMBERED = 1 << 16
#: A connected station, whether or not it transfers a mission, is never silent for this long.
_STILL_S = 1.0
#: Ids behind one peer: a radio or a router may carry several.
_MAX_SPEAKERS = 16


@dataclass(slots=True)
class _Known:
    places: "_Places"
    version: int
    came_at: float
    heard_at: float
    beats: int = 0
    beat_at: float = -inf
    #: It has sent REQUEST_DATA_STREAM; a command.
    uses_streams: bool = False
    uses_commands: bool = False
    #: When each (sysid, compid) was last heard from there.
    speakers: dict[tuple[int, int], float] = field(default_factory=dict)

    @property
    def is_steady(self) -> bool:
        """True if the peer has been heard for a while."""
        return self.beats >= _STEADY_BEATS


def displaced(peers: Mapping[Peer, float], steady: Collection[Peer] = ()) -> Peer:
    """The peer of a full link that makes room for another. `peers`: when each was last heard, in order of arrival.

    The first by precedence keep their slots: a pilot is not displaced by a later crowd, not even after a radio fade.
    Of the others, the longest-silent peer of the host with most peers goes: a crowd is often one host, which changes
    its addresses faster than a pilot's ground station falls silent.
    """
    hosts = Counter(peer.host for peer in peers)
    later = _by_precedence(peers, steady)[min(PRECEDENCE, len(peers) // 2) :]
    return min(later, key=lambda entry: (-hosts[entry[2].host], peers[entry[2]]))[2]


def _by_precedence(peers: Iterable[Peer], steady: Collection[Peer]) -> list[tuple[bool, int, Peer]]:
    """Steady peers first; within each kind one peer of each host, then the second of each; then by arrival.

    Each as (is not steady, its number among its host's peers of that kind, peer).
    """
    rounds: Counter[tuple[bool, Hashable]] = Counter()
    order: list[tuple[bool, int, Peer]] = []
    for peer in peers:
        group = peer not in steady, peer.host
        rounds[group] += 1
        order.append((group[0], rounds[group], peer))
    return sorted(order, key=itemgetter(0, 1))


class _Places:
    """The places of a link's listeners, or of its other peers. A frame costs no more time on a full link."""

    def __init__(self, *, is_listener: bool) -> None:
        self.is_listener = is_listener
        self.size = MAX_LISTENERS if is_listener else MAX_PEERS
        self.known: OrderedDict[Peer, _Known] = OrderedDict()  # the longest-silent first
        self._hosts: Counter[Hashable] = Counter()
        self._first: dict[Peer, None] | None = None  # recomputed after a change
        self._rank_of_last: tuple[bool, float, float] = (True, inf, inf)

    @property
    def is_full(self) -> bool:
        """True if a newcomer displaces another peer."""
        return len(self.known) >= self.size

    @property
    def first(self) -> Mapping[Peer, None]:
        """The peers that are never displaced, in order of precedence."""
        if self._first is None:
            arrived = sorted(self.known, key=lambda peer: self.known[peer].came_at)
            steady = {peer for peer, known in self.known.items() if known.is_steady}
            most = min(PRECEDENCE, self.size // 2)
            order = _by_precedence(arrived, steady)[:most]
            self._first = dict.fromkeys(peer for _, _, peer in order)
            self._rank_of_last = True, inf, inf
            if len(order) == most:
                unsteady, number, last = order[-1]
                self._rank_of_last = unsteady, number, self.known[last].came_at
        return self._first

    def add(self, peer: Peer, known: _Known) -> None:
        self.known[peer] = known
        self._hosts[peer.host] += 1
        self.ranked(known)

    def ranked(self, known: _Known) -> None:
        """A peer has arrived or become steady."""
        if (not known.is_steady, 1, known.came_at) < self._rank_of_last:
            self._first = None

    def remove(self, peer: Peer) -> None:
        """Free a place. The order of the first changes only if the peer is one of them."""
        del self.known[peer]
        self._hosts[peer.host] -= 1
        if not self._hosts[peer.host]:
            del self._hosts[peer.host]
        if self._first is not None and peer in self._first:
            self._first = None

    def displaced(self) -> Peer:
        """The longest-silent peer of the host with most peers that is not among the first; else of any host."""
        first, most = self.first, max(self._hosts.values())
        silent = (peer for least in (most, 0) for peer in self.known if self._hosts[peer.host] >= least)
        return next(peer for peer in silent if peer not in first)


class Stations:
    """The peers that were heard. Each is answered in its own version: MAVLink 2 once it has sent that.

    On a full link a newcomer replaces another peer when it is heard for the second time: made-up addresses are used
    once.
    """

    def __init__(self) -> None:
        self._known: dict[Peer, _Known] = {}  # in order of arrival
        self._places: dict[tuple[str, bool], _Places] = {}
        self._turned_away = array("I", [0]) * _REMEMBERED
        self._displaced: list[Peer] = []
        self._expiry_due = inf
        #: The earliest time that `expire` may have work; may be too early, which saves a search on each frame.
        self.due = inf

    def has_room_for(self, peer: Peer, *, is_listener: bool) -> bool:
        """False if a newcomer's link is full, and it is heard for the first time."""
        if not self._places_on(peer.link, is_listener=is_listener).is_full:
            return True
        mark = crc32(repr(peer).encode())
        has_come_before = self._turned_away[mark % _REMEMBERED] == mark
        self._turned_away[mark % _REMEMBERED] = mark
        return has_come_before

    def heard(self, station: Station, version: int, now: float, *, is_listener: bool = False) -> bool:
        """Note a frame from a station; True if its peer is new, or returns after a silence, perhaps restarted."""
        known = self._known.get(station.peer)
        is_new = known is None or now >= known.heard_at + _RETURNS_S
        if known is None or known.places.is_listener != is_listener:
            known = self._add(station.peer, version, is_listener, now)
        known.heard_at = now
        known.places.known.move_to_end(station.peer)
        known.version = max(known.version, version)
        if known.beats < _STEADY_BEATS and now >= known.beat_at + _BEAT_S:
            known.beats, known.beat_at = known.beats + 1, now
            if known.is_steady:
                known.places.ranked(known)
        self._note_speaker(station, known, now)
        return is_new

    def _add(self, peer: Peer, version: int, is_listener: bool, now: float) -> _Known:
        self.gone(peer)
        places = self._places_on(peer.link, is_listener=is_listener)
        if places.is_full:
            self._displaced.append(places.displaced())
            self.gone(self._displaced[-1])
            self.due = 0.0
        added = self._known[peer] = _Known(places, version, now, now)
        places.add(peer, added)
        return added

    @property
    def steady(self) -> set[Peer]:
        return {peer for peer, known in self._known.items() if known.is_steady}

    def hosts_with_precedence(self) -> dict[Hashable, None]:
        """The hosts of all links' first peers by precedence, in that order."""
        links = (places for places in self._places.values() if not places.is_listener)
        return {peer.host: None for places in links for peer in places.first}

    def has_standing(self, peer: Peer) -> bool:
        """True for the first peers of a link by precedence."""
        known = self._known.get(peer)
        return known is not None and not known.places.is_listener and peer in known.places.first

    def _places_on(self, link: str, *, is_listener: bool) -> _Places:
        places = self._places.get((link, is_listener))
        if places is None:
            places = self._places[link, is_listener] = _Places(is_listener=is_listener)
        return places

    def is_unknown(self, peer: Peer) -> bool:
        return peer not in self._known

    def version(self, peer: Peer) -> int:
        """The MAVLink version for answers."""
        known = self._known.get(peer)
        return 2 if known is None else known.version

    def gone(self, peer: Peer) -> None:
        known = self._known.pop(peer, None)
        if known is not None:
            known.places.remove(peer)

    def expire(self, now: float) -> list[Peer]:
        """Forget silent peers; returns them and those displaced by others."""
        silent = [peer for peer in self._displaced if peer not in self._known]
        self._displaced.clear()
        if now >= self._expiry_due:
            due = self._expiry_times()
            silent += [peer for peer in due if now >= due[peer]]
            for peer in silent:
                self.gone(peer)
            later = (at for at in due.values() if now < at)
            self._expiry_due = max(min(later, default=inf), now + _EXPIRY_INTERVAL_S)
        self.due = self._expiry_due
        return silent

    def peers(self) -> list[Peer]:
        return list(self._known)

    def note_request(self, peer: Peer, *, streams: bool) -> None:
        """A peer has sent REQUEST_DATA_STREAM, or else a command."""
        if (known := self._known.get(peer)) is not None:
            known.uses_streams |= streams
            known.uses_commands |= not streams

    def uses_streams(self, peer: Peer) -> bool:
        """True for Mission Planner, QGroundControl, MAVProxy and DroneKit soon after connecting, never for MAVSDK."""
        known = self._known.get(peer)
        return known is not None and known.uses_streams

    def is_like_mavsdk(self, peer: Peer) -> bool:
        """True for a peer that asks by commands only, and on MAVLink 2, as MAVSDK does from its connection on."""
        known = self._known.get(peer)
        return known is not None and known.version == 2 and known.uses_commands and not known.uses_streams

    def at(self, peer: Peer) -> list[Station]:
        """The stations heard from a peer; several behind a radio or a router."""
        known = self._known.get(peer)
        return [] if known is None else [Station(peer, *speaker) for speaker in known.speakers]

    def is_listener(self, peer: Peer) -> bool:
        """True if a connected peer may only read."""
        known = self._known.get(peer)
        return known is not None and known.places.is_listener

    def moved_to(self, station: Station, now: float) -> list[Station]:
        """The new addresses of a station that fell silent at its old one: usually none."""
        old = self._known.get(station.peer)
        if old is None or now < old.heard_at + _STILL_S:
            return []
        elsewhere = (Station(peer, station.sysid, station.compid) for peer in self._known)
        return [where for where in elsewhere if self.has_moved(station, where, now)]

    def has_moved(self, station: Station, to: Station, now: float) -> bool:
        """True if `to` is the new address of a station that fell silent at its old one.

        This excludes a second station with the same ids, heard earlier or alongside the first.
        """
        speaker = station.sysid, station.compid
        old, new = self._known.get(station.peer), self._known.get(to.peer)
        if old is None or new is None or speaker != (to.sysid, to.compid):
            return False
        return (
            now >= old.heard_at + _STILL_S
            and to.peer != station.peer
            and new.places is old.places
            and speaker in new.speakers
            and new.came_at >= old.heard_at
        )

    def _note_speaker(self, station: Station, known: _Known, now: float) -> None:
        speaker = station.sysid, station.compid
        if speaker not in known.speakers:
            if len(known.speakers) >= _MAX_SPEAKERS:
                return
            # From now on another peer may count as moved.
            self._expiry_due = min(now + MOVED_S, self._expiry_due)
            self.due = min(self.due, self._expiry_due)
        known.speakers[speaker] = now

    def _expiry_times(self) -> dict[Peer, float]:
        latest: dict[tuple[_Places, tuple[int, int]], float] = {}
        for known in self._known.values():
            for speaker, heard_at in known.speakers.items():
                key = known.places, speaker
                latest[key] = max(heard_at, latest.get(key, -inf))
        times = {}
        for peer, known in self._known.items():
            # Heard later at another address: the station has moved there.
            moved = all(latest[known.places, ids] > at for ids, at in known.speakers.items())
            times[peer] = known.heard_at + (MOVED_S if moved else EXPIRY_S)
        return times
