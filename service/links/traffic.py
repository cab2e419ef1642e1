# SPDX-License-Identifier: GPL-3.0-or-later
"""What a port or link has carried."""

from dataclasses import dataclass


@dataclass(slots=True)
class Traffic:
    """The traffic since the start: bytes, and pieces (reads and writes, or datagrams)."""

    pieces_received: int = 0
    bytes_received: int = 0
    pieces_sent: int = 0
    bytes_sent: int = 0

    def received(self, data: bytes) -> None:
        """Count a read."""
        self.pieces_received += 1
        self.bytes_received += len(data)

    def sent(self, data: bytes) -> None:
        """Count a write."""
        self.pieces_sent += 1
        self.bytes_sent += len(data)
