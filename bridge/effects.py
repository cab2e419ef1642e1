# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bridge wants done: `Bridge.take` returns these effects in order, and service/daemon/ carries them out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bridge.gcs.station import Datagrams
from bridge.line.conversation import StoreEffect
from bridge.missions.mission_service import MissionEnded
from bridge.model.craft import FlightMemory
from bridge.model.events import BridgeEvent
from bridge.model.settings import TakenBackup
from reports.vehicle_groups import Group


class SendToBoard(NamedTuple):
    """Write to the flight controller's port, in order, at the speed that it must have, None if it has none.

    `may_gather`: so much is read that waiting a little for more saves time. `asks`: a reply to this must not wait.
    `complete_at`: before this time only a part of the replies that telemetry waits for can have arrived.
    """

    data: Sequence[bytes]
    speed: int | None
    may_gather: bool
    asks: bool
    complete_at: float


class RecordFrames(list[bytes]):  # made for each wake-up in pass-through: as a list, in C
    """Frames to and from ground stations, to be written to the telemetry log."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class PublishGroups:
    """Publish watched groups that have new values."""

    groups: frozenset[Group]


@dataclass(frozen=True, slots=True)
class RememberFlight:
    """Keep this for the BridgeConfig of a restarted bridge. `flight`: None if the craft is not armed."""

    flight: FlightMemory | None


#: A BridgeEvent is to be logged, a StoreEffect is answered with `Bridge.store_answered`.
BridgeEffect = (
    Datagrams | SendToBoard | RecordFrames | PublishGroups | RememberFlight
    | BridgeEvent | StoreEffect | MissionEnded | TakenBackup
)  # fmt: skip
