# SPDX-License-Identifier: GPL-3.0-or-later
"""Links to ground stations, made from their addresses. None of them waits for a slow peer."""

import errno
from typing import Protocol

from bridge.gcs.station import Peer
from protocols.remedies import Fault
from service.links.gcs_events import GcsEvents
from service.links.serial_link import SerialLink
from service.links.tcp_link import TcpLink
from service.links.udp_link import UdpLink
from service.settings.addresses import GcsAddress
from storage.os_error import reason

_FAULTS = {
    errno.EADDRINUSE: Fault.LINK_IN_USE,
    errno.EADDRNOTAVAIL: Fault.LINK_ELSEWHERE,
    errno.EACCES: Fault.LINK_OF_ROOT,
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
        fault = Fault.UNKNOWN_HOST if number < 0 else _FAULTS.get(number)
        why = f"{address} cannot be opened: {reason(error)}"
        raise LinkError(why if fault is None else fault.text(why=why)) from error
