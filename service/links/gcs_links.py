# SPDX-License-Identifier: GPL-3.0-or-later
"""Links to ground stations, made from their addresses. None of them waits for a slow peer."""

import errno
from typing import Protocol

from bridge.gcs.station import Peer
from service.links.gcs_events import GcsEvents
from service.links.serial_link import SerialLink
from service.links.tcp_link import TcpLink
from service.links.udp_link import UdpLink
from service.settings.addresses import UNKNOWN_HOST_HINT, GcsAddress
from storage.os_error import reason

_HINTS = {
    errno.EADDRINUSE: "stop the program that uses it, or choose another port",
    errno.EADDRNOTAVAIL: "this machine has no such address; 0.0.0.0 means all of its addresses",
    errno.EACCES: "ports below 1024 need root; choose another port",
}


class LinkError(Exception):
    """A link cannot be set up. The text is one sentence for the user."""


class GcsLink(Protocol):
    """One --gcs connection."""

    name: str

    def send(self, peer: Peer, data: bytes) -> None:
        """Send without blocking. Drop data that the socket does not accept."""

    def close(self) -> None:
        """Close the sockets."""


def open_link(address: GcsAddress, events: GcsEvents) -> GcsLink:
    """Open a link. LinkError gives the reason if that fails."""
    try:
        if address.kind == "tcpin":
            return TcpLink(address, events)
        return SerialLink(address, events) if address.is_serial else UdpLink(address, events)
    except OSError as error:
        number = error.errno or 0  # below 0 it is one of getaddrinfo's
        hint = UNKNOWN_HOST_HINT if number < 0 else _HINTS.get(number, "")
        text = f"{address} cannot be opened: {reason(error)}"
        raise LinkError(f"{text}; {hint}" if hint else text) from error
