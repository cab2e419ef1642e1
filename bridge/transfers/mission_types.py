# SPDX-License-Identifier: GPL-3.0-or-later
"""The three types of lists of MAVLink's mission protocol: missions, fences and rally points. Sans-IO."""

from collections.abc import Mapping, Sequence
from math import inf
from typing import NamedTuple

from bridge.gcs.ground import Ground
from bridge.gcs.station import Peer
from bridge.missions.fc_mission_store import AnyFcMissionStore
from bridge.missions.mission_service import MissionService
from bridge.missions.place_lists import PlaceLists
from bridge.model.events import Emit
from bridge.model.missions import Refusal
from bridge.transfers.downloads import MissionDownloads
from bridge.transfers.uploads import Handler, MissionUploads, mission_handlers
from protocols.mavlink.dialect import messages as m

READS = frozenset(
    {
        m.MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST,
        m.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
    }
)
ENDS_DOWNLOAD = frozenset(
    {m.MAVLINK_MSG_ID_MISSION_COUNT, m.MAVLINK_MSG_ID_MISSION_CLEAR_ALL, m.MAVLINK_MSG_ID_MISSION_ACK}
)
#: MISSION_ITEM.current of items outside a list: Mission Planner's "Fly to here" and "Change altitude".
GUIDED = (2, 3)


class Transfers(NamedTuple):
    """The lists of one type, and ground stations' transfers of them."""

    lists: MissionService
    uploads: MissionUploads
    downloads: MissionDownloads
    handlers: Mapping[int, Handler]


class MissionTypes:
    """`by_type`: the transfers of each MAV_MISSION_TYPE."""

    def __init__(self, missions: MissionService, ground: Ground, emit: Emit) -> None:
        def transfers(lists: MissionService) -> Transfers:
            uploads, downloads = MissionUploads(lists, ground, emit), MissionDownloads(lists, ground)
            return Transfers(lists, uploads, downloads, mission_handlers(uploads, downloads))

        vehicle, runner = missions.vehicle, missions.runner
        # The check of a mission also uses fences and rally points.
        fences = PlaceLists(m.MAV_MISSION_TYPE_FENCE, "Fence", vehicle, runner, missions.settings_changed)
        rally = PlaceLists(m.MAV_MISSION_TYPE_RALLY, "Rally points", vehicle, runner, missions.settings_changed)
        self._lists = missions, fences, rally
        self.by_type = {lists.mission_type: transfers(lists) for lists in self._lists}
        self.of_missions = self.by_type[m.MAV_MISSION_TYPE_MISSION].uploads
        #: The uploads of all types.
        self.uploads = tuple(each.uploads for each in self.by_type.values())

    def use(self, stores: Sequence[AnyFcMissionStore | Refusal], now: float, *, is_same_board: bool) -> None:
        """Switch to a flight controller's stores of missions, fences and rally points."""
        for lists, store in zip(self._lists, stores, strict=True):
            lists.use(store, now, is_same_board=is_same_board)
        are_only_missions_stored = not self.capabilities()
        for uploads in self.uploads:
            uploads.answers.are_only_missions_stored = uploads is self.of_missions and are_only_missions_stored

    def lost(self, refusal: Refusal, ending: Refusal, now: float) -> None:
        """The flight controller was lost: refuse transfers from now on, and end the uploads."""
        for lists in self._lists:
            lists.use(refusal, now, is_same_board=True)
        self.end_uploads(ending, now)

    def close(self) -> None:
        """Accept no more transfers: the bridge is stopping."""
        for lists in self._lists:
            lists.close()

    def end_uploads(self, refusal: Refusal, now: float) -> None:
        for uploads in self.uploads:
            if uploads.due < inf:
                uploads.end(refusal, now)

    def peer_gone(self, peer: Peer, now: float) -> None:
        for uploads in self.uploads:
            uploads.peer_gone(peer, now)

    def capabilities(self) -> int:
        """MAV_PROTOCOL_CAPABILITY of the lists that the flight controller stores."""
        _, fences, rally = self._lists
        fence = fences.are_stored and m.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        return int(fence | (rally.are_stored and m.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY))
