# SPDX-License-Identifier: GPL-3.0-or-later
"""Events from a link to ground stations."""

from typing import Protocol

from bridge.gcs.station import Peer


class GcsEvents(Protocol):
    """The receiver of a link's events: the daemon."""

    def gcs_data(self, peer: Peer, data: bytes, *, datagram: bool) -> None:
        """Bytes arrived. A datagram holds whole frames."""

    def is_connected(self, peer: Peer) -> bool:
        """True if this peer is a ground station that has shown that it receives what is sent to it."""

    def gcs_gone(self, peer: Peer) -> None:
        """A connection was closed."""

    def add_default_peer(self, peer: Peer, *, until_answered: bool = False) -> None:
        """Send to `peer` before it is heard. With `until_answered` only until any peer of the link is."""

    def remove_default_peer(self, peer: Peer) -> None:
        """Stop sending to an unheard peer."""
