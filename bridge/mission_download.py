"""A ground station reads the mission: the vehicle's side of MAVLink's download (mission-rules.md, "Read-back")."""

from collections.abc import Callable

from bridge.mission_desk import ARMED, HeldMission, MissionDesk, Refusal
from bridge.mission_upload import MISSION_TYPE_MISSION
from bridge.runner import Runner
from bridge.station import Post, Severity, Station
from protocols.mavlink.dialect import messages
from protocols.mavlink.mission_messages import item_message
from protocols.mission_item import Command, Frame, MissionItem, MissionResult

#: Ground stations whose reading is remembered; the oldest is forgotten first.
_MAX_READERS = 16


class MissionDownloads:
    """Every ground station reads its own snapshot: an upload in between cannot mix two lists in it."""

    def __init__(
        self,
        desk: MissionDesk,
        runner: Runner,
        post: Post,
        is_armed: Callable[[], bool | None],
        home: Callable[[], tuple[int, int] | None],
    ) -> None:
        self._desk = desk
        self._runner = runner
        self._post = post
        self._is_armed = is_armed
        self._home = home
        self._snapshots: dict[Station, tuple[MissionItem, ...]] = {}

    def request_list(self, station: Station, mission_type: int, now: float) -> None:
        """MISSION_REQUEST_LIST."""
        if mission_type != MISSION_TYPE_MISSION:
            self._ack(station, MissionResult.UNSUPPORTED, mission_type)
        elif self._is_armed():
            self._refuse(station, Refusal(MissionResult.DENIED, "Armed: disarm to read the mission"))
        else:
            self._read(station, lambda items: self._send_count(station, items), now)

    def request(self, station: Station, seq: int, mission_type: int, now: float, *, as_int: bool) -> None:
        """MISSION_REQUEST or MISSION_REQUEST_INT; item 0 is served at any time (Mission Planner asks on arming)."""
        if mission_type != MISSION_TYPE_MISSION:
            self._ack(station, MissionResult.UNSUPPORTED, mission_type)
            return
        snapshot = self._snapshots.get(station)
        if snapshot is not None:
            self._send_item(station, snapshot, seq, as_int=as_int)
        elif self._is_armed() and seq != 0:
            self._refuse(station, ARMED)
        else:
            self._read(station, lambda items: self._send_item(station, items, seq, as_int=as_int), now)

    def forget(self, station: Station) -> None:
        """The ground station writes a new list, or is gone."""
        self._snapshots.pop(station, None)

    def _read(self, station: Station, then: Callable[[tuple[MissionItem, ...]], None], now: float) -> None:
        def answered(held: HeldMission | Refusal, _at: float) -> None:
            if isinstance(held, Refusal):
                self._refuse(station, held)
                return
            self._snapshots.pop(station, None)
            self._snapshots[station] = held.items
            if len(self._snapshots) > _MAX_READERS:
                del self._snapshots[next(iter(self._snapshots))]
            then(held.items)

        self._runner.start(self._desk.read_back(), answered, now)

    def _send_count(self, station: Station, items: tuple[MissionItem, ...]) -> None:
        self._post.to(
            station,
            messages.MAVLink_mission_count_message(station.sysid, station.compid, len(items), MISSION_TYPE_MISSION),
        )

    def _send_item(self, station: Station, items: tuple[MissionItem, ...], seq: int, *, as_int: bool) -> None:
        if seq < len(items):
            item = items[seq]
        elif seq == 0:
            item = self._home_item()
        else:
            self._ack(station, MissionResult.INVALID_SEQUENCE)
            return
        self._post.to(station, item_message(item, station.sysid, station.compid, as_int=as_int))

    def _home_item(self) -> MissionItem:
        """Item 0 of an empty list: where the flight controller's own home is, as far as it is known."""
        lat_e7, lon_e7 = self._home() or (0, 0)
        return MissionItem(0, Command.NAV_WAYPOINT, Frame.GLOBAL, 0, 0, 0, 0, lat_e7, lon_e7, 0)

    def _refuse(self, station: Station, refusal: Refusal) -> None:
        self._post.say(Severity.ERROR, refusal.text)
        self._ack(station, refusal.ack)

    def _ack(self, station: Station, result: MissionResult, mission_type: int = MISSION_TYPE_MISSION) -> None:
        self._post.to(
            station,
            messages.MAVLink_mission_ack_message(station.sysid, station.compid, result, mission_type),
        )
