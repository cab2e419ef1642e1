# SPDX-License-Identifier: GPL-3.0-or-later
"""The addresses of ground stations."""

from collections.abc import Hashable
from typing import NamedTuple


class Peer(NamedTuple):  # hashed several times for each message: as a tuple, in C
    """The other end of a link: a UDP address or a TCP connection. `key` is the service's own handle."""

    link: str
    key: Hashable

    @property
    def host(self) -> Hashable:
        """The host, which may have several peers."""
        return self.key[0] if isinstance(self.key, tuple) else self.key

    def __str__(self) -> str:
        if not isinstance(self.key, tuple):
            return f"{self.link} {self.key}"
        host, port = map(str, self.key[:2])
        return f"{self.link} [{host}]:{port}" if ":" in host else f"{self.link} {host}:{port}"


class Datagrams(list[tuple[Peer, bytes]]):  # made thousands of times a second: as a list, in C
    """Whole frames to be sent to ground stations, in order."""

    __slots__ = ()


#: The telemetry log as a peer: it is served like a ground station, but no datagram is sent.
RECORDER = Peer("log", "flight")
