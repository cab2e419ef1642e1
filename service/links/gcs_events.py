# SPDX-License-Identifier: GPL-3.0-or-later
"""What a link to ground stations tells the daemon."""

from collections.abc import Mapping
from typing import Protocol

from bridge.gcs.station import Peer


class GcsEvents(Protocol):
    """What a link tells the daemon."""

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        """Bytes came; a datagram holds whole frames."""

    def gcs_gone(self, peer: Peer) -> None:
        """A connection was closed."""

    def displaced(self, peers: Mapping[Peer, float]) -> Peer:
        """Which of a full link's connections makes room. `peers`: when each last spoke, oldest first."""

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """`peer` is spoken to before it was heard; or only as long as nobody on its link was heard."""

    def remove_default_peer(self, peer: Peer) -> None:
        """It is not any more."""
