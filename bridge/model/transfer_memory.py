# SPDX-License-Identifier: GPL-3.0-or-later
"""State kept after a ground station's mission transfers, to answer its repeated messages."""

from collections.abc import Sequence
from dataclasses import dataclass

from protocols.mission_item import MissionItem, MissionResult


@dataclass(slots=True)
class FinalAck:
    """The MISSION_ACK that ended an upload of `count` items. It answers a Cancel until `cancelled_until`."""

    ack: MissionResult
    count: int
    until: float
    cancelled_until: float
    #: When to send the ack again, or the reason for a refusal.
    again: Sequence[tuple[float, str | None]] = ()

    @property
    def is_refusal(self) -> bool:
        return self.ack is not MissionResult.ACCEPTED


@dataclass(slots=True)
class Download:
    """The list as of the start of a download, from the flight controller's `fc_store`."""

    items: tuple[MissionItem, ...]
    until: float
    fc_store: object


@dataclass(slots=True)
class TransferMemory:
    """One station's running download, and the answer to its last upload, of one mission type."""

    download: Download | None = None
    final_ack: FinalAck | None = None
