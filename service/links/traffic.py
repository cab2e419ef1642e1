# SPDX-License-Identifier: GPL-3.0-or-later
"""Traffic counters of a port or link."""

from dataclasses import dataclass


@dataclass(slots=True)
class Traffic:
    """Bytes since the start."""

    bytes_received: int = 0
    bytes_sent: int = 0
