# SPDX-License-Identifier: GPL-3.0-or-later
"""Traffic counters of a port or link."""

from dataclasses import dataclass


@dataclass(slots=True)
class Traffic:
    """The traffic since the start: bytes, and pieces (reads and writes, or datagrams)."""

    pieces_received: int = 0
    bytes_received: int = 0
    pieces_sent: int = 0
    bytes_sent: int = 0
