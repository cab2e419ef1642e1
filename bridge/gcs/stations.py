# SPDX-License-Identifier: GPL-3.0-or-later
"""Which ground stations are there, and in which MAVLink version each is spoken to."""

from dataclasses import dataclass, field
from math import inf

from bridge.gcs.station import Peer, Station

#: A UDP peer that is silent for so long has left; its TCP kind is ended by its connection.
EXPIRY_S = 60.0
#: The same for one whose every speaker is heard from elsewhere now: its Wi-Fi gave it another address.
MOVED_S = 5.0
#: More are not spoken to: every heartbeat costs a datagram for each.
MAX_PEERS = 32
#: Who transfers a mission or is just there is not silent for so long.
_STILL_S = 1.0
#: Behind one peer: a radio or a router may carry several.
_MAX_SPEAKERS = 16
#: A new one takes the place of one that was silent for so long: a ground station sends a heartbeat every second.
_MAKES_ROOM_S = 5.0


@dataclass(slots=True)
class _Known:
    version: int
    came_at: float
    heard_at: float
    #: When each (sysid, compid) was heard from there.
    speakers: dict[tuple[int, int], float] = field(default_factory=dict)


class Stations:
    """The peers that were heard. A peer is answered in the version that it speaks; MAVLink 2 once it showed it."""

    def __init__(self) -> None:
        self._known: dict[Peer, _Known] = {}
        self._displaced: list[Peer] = []
        self._expiry_due: float | None = None

    def heard(self, station: Station, version: int, now: float) -> bool:
        """Note a frame from a station; False if its peer is not known."""
        known = self._known.get(station.peer)
        if known is None:
            return False
        known.heard_at = now
        known.version = max(known.version, version)
        self._note_speaker(station, known, now)
        return True

    def add(self, station: Station, version: int, now: float) -> bool:
        """Take a new peer in, in the place of the one silent for longest if need be; False if there are too many."""
        if len(self._known) >= MAX_PEERS:
            silent = min(self._known, key=lambda known: self._known[known].heard_at)
            if now - self._known[silent].heard_at < _MAKES_ROOM_S:
                return False
            del self._known[silent]
            self._displaced.append(silent)
            self._expiry_due = now
        known = self._known[station.peer] = _Known(version, now, now)
        self._note_speaker(station, known, now)
        return True

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
        """Return all peers that are there."""
        return list(self._known)

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
        others = [other for where, other in self._known.items() if where != peer and where.link == peer.link]
        moved = all(
            any(other.speakers.get(speaker, -inf) > heard_at for other in others)
            for speaker, heard_at in known.speakers.items()
        )
        return known.heard_at + (MOVED_S if moved else EXPIRY_S)
