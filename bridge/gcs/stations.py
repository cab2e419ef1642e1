# SPDX-License-Identifier: GPL-3.0-or-later
"""Which ground stations are there, and in which MAVLink version each is spoken to."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from bridge.gcs.station import Peer, Station

#: A UDP peer that is silent for so long has left; its TCP kind is ended by its connection.
EXPIRY_S = 60.0
#: The same for one whose every speaker is heard from elsewhere now: its Wi-Fi gave it another address.
MOVED_S = 5.0
#: More on one link are not spoken to: every heartbeat costs a datagram for each.
MAX_PEERS = 32
#: The same for peers that may only read, so that they leave the places of those with the key alone.
MAX_LISTENERS = 8
#: Who transfers a mission or is just there is not silent for so long.
_STILL_S = 1.0
#: Behind one peer: a radio or a router may carry several.
_MAX_SPEAKERS = 16


@dataclass(slots=True)
class _Known:
    version: int
    is_listener: bool
    came_at: float
    heard_at: float
    #: When each (sysid, compid) was heard from there.
    speakers: dict[tuple[int, int], float] = field(default_factory=dict)


def displaced(peers: Mapping[Peer, float]) -> Peer:
    """The one of a full link's peers that makes room for another. `peers`: when each was last heard, oldest first.

    The half that came first keeps its places: a pilot is not displaced by a crowd that came later, not even after a
    radio fade. Among the others it is the one of the busiest machine that was silent for longest, because a crowd is
    often one machine, and changes its addresses faster than a pilot's ground station is silent.
    """
    hosts = Counter(peer.host for peer in peers)
    later = list(peers)[len(peers) // 2 :]
    return min(later, key=lambda peer: (-hosts[peer.host], peers[peer]))


class Stations:
    """The peers that were heard. A peer is answered in the version that it speaks; MAVLink 2 once it showed it.

    A newcomer is always taken in: on a full link in the place of another.
    """

    def __init__(self) -> None:
        self._known: dict[Peer, _Known] = {}  # in the order in which they came
        self._displaced: list[Peer] = []
        self._expiry_due: float | None = None

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
        rivals = {
            other: known.heard_at
            for other, known in self._known.items()
            if other.link == peer.link and known.is_listener == is_listener
        }
        if len(rivals) >= (MAX_LISTENERS if is_listener else MAX_PEERS):
            other = displaced(rivals)
            del self._known[other]
            self._displaced.append(other)
            self._expiry_due = now
        added = self._known[peer] = _Known(version, is_listener, now, now)
        return added

    def is_senior(self, peer: Peer) -> bool:
        """True if a peer was there before the half of its full link."""
        known = self._known.get(peer)
        if known is None:
            return False
        same = [other for other, its in self._known.items() if (other.link, its.is_listener) == (peer.link, False)]
        return peer in same[: MAX_PEERS // 2]

    def is_unknown(self, peer: Peer) -> bool:
        """Tell whether nothing was heard from `peer`."""
        return peer not in self._known

    def version(self, peer: Peer) -> int:
        """Return the MAVLink version in which to answer."""
        known = self._known.get(peer)
        return 2 if known is None else known.version

    def gone(self, peer: Peer) -> None:
        """The peer's connection is closed."""
        self._known.pop(peer, None)

    def expire(self, now: float) -> list[Peer]:
        """Forget peers that fell silent, and return them and those who made room for others."""
        if self._expiry_due is None or now < self._expiry_due:
            return []
        silent = [peer for peer, known in self._known.items() if now >= self._expires_at(peer, known)]
        for peer in silent:
            del self._known[peer]
        silent += [peer for peer in self._displaced if peer not in self._known]
        self._displaced.clear()
        self._expiry_due = min((self._expires_at(peer, known) for peer, known in self._known.items()), default=None)
        return silent

    def next_deadline(self) -> float | None:
        """Return when the first may have expired: rather too early than looking at all of them each time."""
        return self._expiry_due

    def peers(self) -> list[Peer]:
        """All peers that are there."""
        return list(self._known)

    def is_listener(self, peer: Peer) -> bool:
        """True if a peer that is there may only read."""
        known = self._known.get(peer)
        return known is not None and known.is_listener

    def moved_to(self, station: Station, now: float) -> list[Station]:
        """Return from where a station is heard that fell silent where it was: as a rule nowhere.

        A second one with the same ids was heard before, or the first one goes on.
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
            # From now on somebody else may count as moved.
            self._expiry_due = now + MOVED_S if self._expiry_due is None else min(now + MOVED_S, self._expiry_due)
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
