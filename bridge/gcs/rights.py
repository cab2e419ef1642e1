# SPDX-License-Identifier: GPL-3.0-or-later
"""The rights of ground stations, and how a link's stations prove them. `RIGHTS` is the whole policy."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from bridge.gcs.station import Peer
from protocols.mavlink.signing import SignedPeer, Signing
from protocols.rights import Effect


class Standing(Enum):
    """The rights that a ground station has proven."""

    LISTENER = "may only read"
    OPEN = "its link is open"
    PROVEN = "has the key or address that its link requires"


class Rights(NamedTuple):
    """The effects that a station may have on the bridge's vehicle, a passed-through autopilot, and other stations."""

    own: Collection[Effect]
    autopilot: Collection[Effect]
    stations: Collection[Effect]


_ALL = tuple(effect for effect in Effect if effect is not Effect.KEY)
_NO_COMMANDS = Effect.READ, Effect.DIALOGUE, Effect.RATE, Effect.CHANGE
#: The own vehicle itself refuses to arm, to restart, and to move except by Set WP, which needs the right to move an
#: autopilot; other stations hear what concerns only themselves.
RIGHTS: Mapping[Standing, Rights] = {
    Standing.LISTENER: Rights((Effect.READ, Effect.DIALOGUE), (Effect.READ,), ()),
    Standing.OPEN: Rights(_ALL, _NO_COMMANDS, (*_NO_COMMANDS, Effect.REPORT)),
    Standing.PROVEN: Rights(_ALL, _ALL, _ALL),
}


class FrameRefusal(NamedTuple):
    """The reason for refusing a frame.

    `is_routine`: ground stations repeat it, so it is not reported. `is_forged`: the station has the key, but this frame
    is not signed with it, or is a copy. It is not answered and does not affect the time the station was last
    heard.
    """

    why: str
    is_routine: bool
    is_forged: bool = False


@dataclass(frozen=True, slots=True)
class LinkAccess:
    """The conditions for writing over a link. `signing`: a signature with the key. `may_write`: the right address.

    None: not required. Everything the bridge sends over a link with `signing` is signed. `link_id` is the link's number
    in the signature. `passes_everything`: without conditions, an autopilot that speaks MAVLink itself also gets
    commands.
    """

    signing: Signing | None = None
    link_id: int = 0
    may_write: Callable[[Peer], bool] | None = None
    passes_everything: bool = False

    def signed_peer(self, peer: Peer) -> SignedPeer | None:
        """The signatures of a peer, or None if the link requires none."""
        return None if self.signing is None else SignedPeer(self.signing, self.link_id, peer.host)

    def standing(self, peer: Peer, *, has_key: bool) -> Standing:
        """The standing of a station. `has_key`: it has sent a valid signature."""
        if self.signing is None and self.may_write is None:
            return Standing.OPEN
        is_proven = (self.signing is None or has_key) and (self.may_write is None or self.may_write(peer))
        return Standing.PROVEN if is_proven else Standing.LISTENER

    def rights(self, standing: Standing) -> Rights:
        return RIGHTS[Standing.PROVEN if self.passes_everything and standing is Standing.OPEN else standing]
