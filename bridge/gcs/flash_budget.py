# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits the writes to the flight controller's flash, whose pages endure 10,000 each. Sans-IO.

All ground stations on open links together get 400 writes at once and 12 an hour: to wear out a page, strangers would
have to write for a month. A Harakiri with the mission extension has its own limit (docs/msp-mission.md).
"""

from bridge.gcs.budget import TokenBucket
from bridge.gcs.cost import FLASH_RESERVE, FLASH_SHARED
from bridge.gcs.ground_station import GroundStation
from bridge.gcs.rights import Standing

#: The text for a ground station whose share is used up.
TOO_MANY_WRITES = "Flash wear limit: try again in 10 minutes"


class FlashBudget:
    """All hosts on an open link may write until the shared limit is used up; then each seat still has its reserve.

    A station with the key or a listed address has 400 writes at once and 12 an hour for its host alone.
    """

    def __init__(self) -> None:
        self._shared = TokenBucket(FLASH_SHARED)
        self._without_seat = TokenBucket(FLASH_RESERVE)

    def allows(self, station: GroundStation | None, now: float) -> bool:
        """Count a write; False if it must wait. None: a station that has left."""
        if any(bucket.take(now) for bucket in self._buckets(station)):
            if station is not None and station.host is not None:
                station.host.wrote_at = now
            return True
        return False

    def not_written(self, station: GroundStation | None) -> None:
        """Take back a write: the flash held the same already, or the flight controller refused."""
        next((bucket for bucket in self._buckets(station) if bucket.used), self._shared).spend(-1.0)

    def _buckets(self, station: GroundStation | None) -> list[TokenBucket]:
        host = None if station is None else station.host
        if host is not None and station is not None and station.standing is Standing.PROVEN:
            return [host.proven_writes]
        seat = host.seat if host is not None and host.is_steady else None
        return [self._shared, self._without_seat if seat is None else seat]
