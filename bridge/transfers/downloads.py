# SPDX-License-Identifier: GPL-3.0-or-later
"""A ground station reads the mission: the vehicle's side of MAVLink's download (docs/mission-rules.md, "Read-back")."""

from dataclasses import dataclass, replace

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import Sender
from bridge.missions.mission_service import HeldMission, MissionService
from bridge.model.craft import Home
from bridge.model.missions import Download, Refusal, TransferMemory
from bridge.voice import sentences
from bridge.voice.stations import Kind
from protocols.mavlink.codec import item_message
from protocols.mavlink.dialect import messages
from protocols.mission_item import Command, Frame, MissionItem, MissionResult

#: A download has ended after this long without a request, even if its MISSION_ACK was lost. Mission Planner repeats
#: the request for an item for 15 s.
_READING_S = 20.0
#: Requests waiting for the list to be read; further requests are dropped, and their senders repeat them.
_MAX_QUESTIONS = 32


@dataclass(frozen=True, slots=True)
class _Question:
    """A ground station's request: item `seq`, or the count if None."""

    sender: Sender
    seq: int | None
    as_int: bool


class MissionDownloads:
    """Every ground station reads its own snapshot, so an upload meanwhile cannot mix two lists."""

    def __init__(self, missions: MissionService, ground: Ground) -> None:
        self._missions = missions
        self._ground = ground
        self._vehicle = missions.vehicle
        #: Item 0 of a mission.
        self._has_home = missions.mission_type == messages.MAV_MISSION_TYPE_MISSION
        self._questions: dict[_Question, None] = {}

    def request_list(self, sender: Sender, now: float) -> None:
        """MISSION_REQUEST_LIST, armed or not."""
        self._ask(_Question(sender, None, as_int=True), now)

    def request(self, sender: Sender, seq: int, now: float, *, as_int: bool) -> None:
        """MISSION_REQUEST or MISSION_REQUEST_INT. Item 0 is served at any time (Mission Planner asks on arming)."""
        question = _Question(sender, seq, as_int)
        download = self._memory(sender).download
        if download is not None and now < download.until and download.fc_store is self._missions.fc_store:
            download.until = now + _READING_S
            self._answer(question, download.items, now)
        elif self._vehicle.armed and seq == 0 and self._has_home:
            self._send_home(question)
        else:
            self._ask(question, now)

    def forget(self, sender: Sender) -> None:
        """The ground station has read the list, or writes a new list."""
        self._memory(sender).download = None

    def _memory(self, sender: Sender) -> TransferMemory:
        return sender.transfers[self._missions.mission_type]

    def _ask(self, question: _Question, now: float) -> None:
        """Read the list once for all waiting requests, so that a flood of them cannot fill the queue."""
        is_reading = bool(self._questions)
        if len(self._questions) < _MAX_QUESTIONS:
            self._questions[question] = None
        if is_reading:
            return
        held = self._missions.held
        if held is not None and not question.sender.station.allows(Cost.BOARD):
            # A station that asks too often gets the copy.
            self._read(held, now)
        else:
            self._missions.run(self._missions.shown(), self._read, now)

    def _read(self, held: HeldMission | Refusal, now: float) -> None:
        questions, self._questions = self._questions, {}
        for question in questions:
            if isinstance(held, Refusal):
                self._answer_unread(question, held, now)
                continue
            download = Download(held.items, now + _READING_S, self._missions.fc_store)
            self._memory(question.sender).download = download
            self._answer(question, held.items, now)

    def _answer_unread(self, question: _Question, why: Refusal, now: float) -> None:
        sender, vehicle, kind = question.sender, self._vehicle, question.sender.station.behaviour.kind
        is_missing = self._has_home and (vehicle.armed or isinstance(self._missions.fc_store, Refusal))
        if question.seq is None and (is_missing or kind is Kind.QGROUNDCONTROL):
            # QGroundControl reads at each connection (InitialConnectStateMachine): a refusal would be a dialog. Later
            # requests are its pilot's, and each of Mission Planner's.
            memory = self._memory(sender)
            is_pilots, memory.has_asked = memory.has_asked or kind is Kind.MISSION_PLANNER, True
            sender.say(why.why if is_pilots else sentences.NO_LIST(why.text))
            self._answer(question, (), now)
        elif question.seq == 0 and self._has_home and (vehicle.armed or vehicle.home_or_position() is not None):
            # Mission Planner requests item 0 on arming, which may have just changed the protocol.
            self._send_home(question)
        elif question.seq != 0 or vehicle.armed is not None:
            sender.refuse(why, self._missions.mission_type)
        # Otherwise the craft may be armed: Mission Planner repeats the request until that is known.

    def _answer(self, question: _Question, items: tuple[MissionItem, ...], now: float) -> None:
        sender = question.sender
        if question.seq is None:
            # DroneKit takes home from a download, and waits forever without one: so an empty list has home if known.
            count = len(items) or int(self._has_home and self._vehicle.home_or_position() is not None)
            kind = self._missions.mission_type
            sender.to(messages.MAVLink_mission_count_message(sender.sysid, sender.compid, count, kind))
        elif question.seq < len(items):
            self._send_item(question, items[question.seq])
            if question.seq == len(items) - 1:
                self._missions.note_reader(sender.identity)
        elif question.seq == 0 and self._has_home:
            self._send_item(question, self._home_item())
        else:
            sender.mission_ack(MissionResult.INVALID_SEQUENCE, self._missions.mission_type)

    def _send_item(self, question: _Question, item: MissionItem) -> None:
        sender = question.sender
        kind = self._missions.mission_type
        sender.to(item_message(item, sender.sysid, sender.compid, kind, as_int=question.as_int))

    def _send_home(self, question: _Question) -> None:
        """Item 0 while armed, at the altitude of HOME_POSITION: Mission Planner's ground level."""
        home = self._vehicle.home_or_position()
        item = self._missions.home_item() or self._home_item()
        if home is not None and home.altitude_m is not None:
            item = replace(item, alt_m=home.altitude_m)
        self._send_item(question, item)

    def _home_item(self) -> MissionItem:
        """Item 0 of an empty list: home, or zeros if unknown."""
        home = self._vehicle.home_or_position() or Home(0, 0)
        return MissionItem(
            0, Command.NAV_WAYPOINT, Frame.GLOBAL, 0, 0, 0, 0, home.lat_e7, home.lon_e7, home.altitude_m or 0.0
        )
