"""Which ground stations are there, and in which MAVLink version each is spoken to."""

from dataclasses import dataclass

from bridge.station import Peer

#: A UDP peer that is silent for so long has left; its TCP kind is ended by its connection.
EXPIRY_S = 60.0
#: More are not spoken to: every heartbeat costs a datagram for each.
MAX_PEERS = 32
#: A new one takes the place of one that was silent for so long: a ground station sends a heartbeat every second.
_MAKES_ROOM_S = 5.0


@dataclass(slots=True)
class _Known:
    version: int
    heard_at: float


class Stations:
    """The peers that were heard. A peer is answered in the version that it speaks; MAVLink 2 once it showed it."""

    def __init__(self) -> None:
        self._known: dict[Peer, _Known] = {}
        self._expiry_due: float | None = None

    def heard(self, peer: Peer, version: int, now: float) -> bool:
        """Note a frame from `peer`; False if the peer is not known."""
        known = self._known.get(peer)
        if known is None:
            return False
        known.heard_at = now
        known.version = max(known.version, version)
        return True

    def add(self, peer: Peer, version: int, now: float) -> bool:
        """Take a new peer in, in the place of the one silent for longest if need be; False if there are too many."""
        if len(self._known) >= MAX_PEERS:
            silent = min(self._known, key=lambda known: self._known[known].heard_at)
            if now - self._known[silent].heard_at < _MAKES_ROOM_S:
                return False
            del self._known[silent]
        self._known[peer] = _Known(version, now)
        if self._expiry_due is None:
            self._expiry_due = now + EXPIRY_S
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
        """Forget peers that fell silent, and return them."""
        if self._expiry_due is None or now < self._expiry_due:
            return []
        silent = [peer for peer, known in self._known.items() if now >= known.heard_at + EXPIRY_S]
        for peer in silent:
            del self._known[peer]
        self._expiry_due = min((known.heard_at + EXPIRY_S for known in self._known.values()), default=None)
        return silent

    def next_deadline(self) -> float | None:
        """Return when the first may have expired: rather too early than looking at all of them each time."""
        return self._expiry_due

    def peers(self) -> list[Peer]:
        """Return all peers that are there."""
        return list(self._known)
