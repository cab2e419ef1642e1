# SPDX-License-Identifier: GPL-3.0-or-later
"""The connected ground stations, and the MAVLink version for each."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from bridge.gcs.budget import TokenBucket
from bridge.gcs.cost import Rate
from bridge.gcs.station import Peer, Station

#: A UDP peer that is silent for this long has left; a TCP peer leaves with its connection.
EXPIRY_S = 60.0
#: The same for a peer all of whose ids are now heard from elsewhere: its Wi-Fi gave it another address.
MOVED_S = 5.0
#: Peers on one link; every heartbeat costs a datagram for each.
MAX_PEERS = 32
#: The same for peers that may only read, so that they take no slot from those with the key.
MAX_LISTENERS = 8
#: Newcomers to a full link: addresses may be made up by the thousand. A pilot who comes now must be among them.
_NEWCOMERS = Rate(1000, 1000)
#: A connected station, whether or not it transfers a mission, is never silent for this long.
_STILL_S = 1.0
#: Ids behind one peer: a radio or a router may carry several.
_MAX_SPEAKERS = 16


@dataclass(slots=True)
class _Known:
    version: int
    is_listener: bool
    came_at: float
    heard_at: float
    #: When each (sysid, compid) was last heard from there.
    speakers: dict[tuple[int, int], float] = field(default_factory=dict)


def displaced(peers: Mapping[Peer, float]) -> Peer:
    """The peer of a full link that makes room for another. `peers`: when each was last heard, in order of arrival.

    The first half keeps its slots: a pilot is not displaced by a later crowd, not even after a radio fade. Of the
    others, the longest-silent peer of the host with most peers goes: a crowd is often one host, which changes its
    addresses faster than a pilot's ground station falls silent.
    """
    hosts = Counter(peer.host for peer in peers)
    later = list(peers)[len(peers) // 2 :]
    return min(later, key=lambda peer: (-hosts[peer.host], peers[peer]))


def _slots(*, is_listener: bool) -> int:
    return MAX_LISTENERS if is_listener else MAX_PEERS


class Stations:
    """The peers that were heard. Each is answered in its own version: MAVLink 2 once it has sent that.

    A newcomer is always accepted; on a full link it replaces another peer.
    """

    def __init__(self) -> None:
        self._known: dict[Peer, _Known] = {}  # in order of arrival
        self._newcomers = TokenBucket(_NEWCOMERS)
        self._seniors: set[Peer] | None = None  # counted again after each change
        self._displaced: list[Peer] = []
        self._expiry_due = inf

    def admits(self, peer: Peer, now: float, *, is_listener: bool) -> bool:
        """Count a frame of an unproven peer; False if it is a newcomer to a full link and there are too many."""
        if peer in self._known:
            return True
        if len(self._alongside(peer.link, is_listener=is_listener)) < _slots(is_listener=is_listener):
            return True
        if not self._newcomers.has(now):
            return False
        self._newcomers.spend()
        return True

    def heard(self, station: Station, version: int, now: float, *, is_listener: bool = False) -> bool:
        """Note a frame from a station; True if its peer is new."""
        known = self._known.get(station.peer)
        is_new = known is None
        if known is None or known.is_listener != is_listener:
            known = self._add(station.peer, version, is_listener, now)
        known.heard_at = now
        known.version = max(known.version, version)
        self._note_speaker(station, known, now)
        return is_new

    def _add(self, peer: Peer, version: int, is_listener: bool, now: float) -> _Known:
        self._known.pop(peer, None)
        self._seniors = None
        rivals = self._alongside(peer.link, is_listener=is_listener)
        if len(rivals) >= _slots(is_listener=is_listener):
            other = displaced(rivals)
            del self._known[other]
            self._displaced.append(other)
        added = self._known[peer] = _Known(version, is_listener, now, now)
        return added

    def _alongside(self, link: str, *, is_listener: bool) -> dict[Peer, float]:
        """When each peer of this kind on a link was last heard."""
        return {
            other: known.heard_at
            for other, known in self._known.items()
            if other.link == link and known.is_listener == is_listener
        }

    def is_senior(self, peer: Peer) -> bool:
        """True if a peer belongs to the half of its full link that arrived first."""
        if self._seniors is None:
            self._seniors = set()
            for link in {other.link for other in self._known}:
                same = [other for other, its in self._known.items() if other.link == link and not its.is_listener]
                self._seniors.update(same[: MAX_PEERS // 2])
        return peer in self._seniors

    def is_unknown(self, peer: Peer) -> bool:
        """True if nothing was heard from `peer`."""
        return peer not in self._known

    def version(self, peer: Peer) -> int:
        """The MAVLink version for answers."""
        known = self._known.get(peer)
        return 2 if known is None else known.version

    def gone(self, peer: Peer) -> None:
        """The peer's connection is closed."""
        self._known.pop(peer, None)
        self._seniors = None

    def expire(self, now: float) -> list[Peer]:
        """Forget silent peers; returns them and those displaced by others."""
        silent = [peer for peer in self._displaced if peer not in self._known]
        self._displaced.clear()
        if now >= self._expiry_due:
            silent += [peer for peer, known in self._known.items() if now >= self._expires_at(peer, known)]
            for peer in silent:
                self._known.pop(peer, None)
            self._seniors = None
            self._expiry_due = min((self._expires_at(peer, known) for peer, known in self._known.items()), default=inf)
        return silent

    def next_deadline(self) -> float:
        """The earliest time that a peer may expire; may be too early, which saves a search on each frame."""
        return 0.0 if self._displaced else self._expiry_due

    def peers(self) -> list[Peer]:
        """All connected peers."""
        return list(self._known)

    def is_listener(self, peer: Peer) -> bool:
        """True if a connected peer may only read."""
        known = self._known.get(peer)
        return known is not None and known.is_listener

    def moved_to(self, station: Station, now: float) -> list[Station]:
        """The new addresses of a station that fell silent at its old one: usually none.

        This excludes a second station with the same ids, heard earlier or alongside the first.
        """
        old = self._known.get(station.peer)
        if old is None or now < old.heard_at + _STILL_S:
            return []
        speaker = station.sysid, station.compid
        return [
            Station(peer, *speaker)
            for peer, known in self._known.items()
            if peer != station.peer
            and peer.link == station.peer.link
            and known.is_listener == old.is_listener
            and speaker in known.speakers
            and known.came_at >= old.heard_at
        ]

    def _note_speaker(self, station: Station, known: _Known, now: float) -> None:
        speaker = station.sysid, station.compid
        if speaker not in known.speakers:
            if len(known.speakers) >= _MAX_SPEAKERS:
                return
            # From now on another peer may count as moved.
            self._expiry_due = min(now + MOVED_S, self._expiry_due)
        known.speakers[speaker] = now

    def _expires_at(self, peer: Peer, known: _Known) -> float:
        others = [
            other
            for where, other in self._known.items()
            if where != peer and where.link == peer.link and other.is_listener == known.is_listener
        ]
        moved = all(
            any(other.speakers.get(speaker, -inf) > heard_at for other in others)
            for speaker, heard_at in known.speakers.items()
        )
        return known.heard_at + (MOVED_S if moved else EXPIRY_S)
