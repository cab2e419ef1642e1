# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames from ground stations: checked, then answered by the message router, or passed on to an autopilot. Sans-IO."""

from collections import Counter
from collections.abc import Callable
from itertools import product

from bridge.gcs.budget import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.ground_station import GroundStation, Sender
from bridge.gcs.return_path import NOT_SHOWN
from bridge.gcs.rights import FrameRefusal
from bridge.gcs.routes import Routes
from bridge.gcs.station import Peer
from bridge.model.events import Emit, GcsRefused
from bridge.settings.parameters import Parameters
from bridge.vehicle.message_router import MessageRouter
from bridge.voice.sentences import FRAME_REFUSED
from protocols.mavlink.codec import FrameWriter, decode
from protocols.mavlink.dialect import MESSAGE_FORMATS, CommandResult, Message
from protocols.mavlink.dialect import messages as m
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.ftp import refuse
from protocols.mission_item import MissionResult
from protocols.rights import Effect
from protocols.rights.mavlink import effect_of

#: The reason why the frames of such a sender are ignored.
OWN_IDS = "sent with the vehicle's own sysid and compid"


class Incoming:
    """Checks, counts, and answers or passes on every frame from a ground station.

    Refusals are logged once for each station and reason; bridge/gcs/rights.py has their policy. `routes` is set while
    an autopilot that represents itself is on the line; frames then go to it unchanged.
    """

    def __init__(
        self,
        ground: Ground,
        router: MessageRouter,
        parameters: Parameters,
        send_to_autopilot: Callable[[bytes], None],
        sysid: int,
        compid: int,
        emit: Emit,
    ) -> None:
        self._ground = ground
        self._router = router
        self._parameters = parameters
        self._send_to_autopilot = send_to_autopilot
        self._ids = sysid, compid
        self._emit = emit
        self._our_targets = frozenset(product((0, sysid), (0, compid)))
        self.routes: Routes | None = None
        #: Refusals by (link, reason).
        self.refused: Counter[tuple[str, str]] = Counter()

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station. Returns False if they are dropped. A datagram holds whole frames only."""
        received = self._ground.received(peer, data, now, datagram=datagram)
        if received is None:
            return False
        station, frames = received
        for frame in frames:
            ids, target, msgid = frame.sender, frame.target, frame.msgid
            if ids == self._ids:
                # Own frames, which have no such target, come back from a broadcast, or from a router that floods.
                if target[0] == ids[0]:
                    self._ignore(OWN_IDS, station, frame)
                continue
            effect = effect_of(frame)
            refused = station.refusal(frame, effect)
            if refused is not None:
                self.refused[peer.link, refused.why] += 1
                if refused.is_forged:
                    self._report(refused, station, frame)
                    continue
            if not (station.is_heard or self._ground.admits(station, now)):
                return False
            sender = self._ground.heard(station, frame, ids, now)
            if sender is None:
                self._ignore_unproven(station, frame)
            elif refused is not None:
                self._answer_refused(refused, sender, frame)
            elif self.routes is not None:
                self._pass_on(self.routes, sender, frame, effect)
            else:
                self._record(station, frame)
                if target in self._our_targets:
                    self._router.take(sender, frame, msgid, now)
                elif target[0] == self._ids[0]:
                    why = f"addressed to component {target[1]} instead of {self._ids[1]}"
                    self._ignore(why, station, frame)
        return True

    def _ignore(self, why: str, station: GroundStation, frame: MavlinkFrame) -> None:
        """Count and report a frame that does not get an answer."""
        self.refused[station.peer.link, why] += 1
        # A station that is not heard is forgotten with each datagram.
        if station.is_heard or self.refused[station.peer.link, why] == 1:
            self._report(FrameRefusal(why, is_routine=False), station, frame)

    def _record(self, station: GroundStation, frame: MavlinkFrame) -> None:
        recorded = self._ground.outbox.recorded
        if recorded is not None and not station.is_listener and station.allows(Cost.RECORDED):
            recorded.append(frame.raw)

    def _ignore_unproven(self, station: GroundStation, frame: MavlinkFrame) -> None:
        """Report a station that has not shown that it receives anything, once it had several opportunities."""
        if station.return_path is not None and station.return_path.has_failed:
            self._ignore(NOT_SHOWN, station, frame)

    def _pass_on(self, routes: Routes, sender: Sender, frame: MavlinkFrame, effect: Effect) -> None:
        """Send a frame on to its targets, within its sender's rights."""
        station = sender.station
        if not station.allows(Cost.PASSED) or routes.is_echo(frame):
            return
        to_stations = effect in station.rights.stations
        is_for_autopilot = routes.from_station(station, frame, to_stations=to_stations)
        if is_for_autopilot or not to_stations:
            refused = station.passing_refusal(effect)
            if refused is not None:
                if not station.is_listener:
                    self.refused[station.peer.link, refused.why] += 1
                self._answer_refused(refused, sender, frame)
                return
        self._record(station, frame)
        if is_for_autopilot:
            self._send_to_autopilot(frame.raw)

    def _answer_refused(self, refused: FrameRefusal, sender: Sender, frame: MavlinkFrame) -> None:
        """Answer a refused frame under the ids that it addressed, if these are the vehicle's."""
        station = sender.station
        self._report(refused, station, frame)
        writer = None
        is_vehicle = frame.target in self._our_targets
        if self.routes is not None:
            asked = self.routes.addressed(*frame.target)
            is_vehicle = asked is not None
            writer = None if asked is None else FrameWriter(*asked, station.sign)
        if not (is_vehicle and station.allows(Cost.ANSWER)):
            return
        message = decode(frame)
        answer = None if message is None else _denial(message, sender)
        if answer is not None:
            self._ground.outbox.send(station, [answer], writer)
        elif message is not None and frame.msgid == m.MAVLINK_MSG_ID_PARAM_SET and self.routes is None:
            self._parameters.refuse(sender, message.param_id)
        why, now = FRAME_REFUSED(refused.why), station.heard_at
        is_new = not refused.is_routine and not station.bad_news.is_repeated(why, now, is_routine=False)
        if is_new and station.allows(Cost.TEXT):
            text = m.MAVLink_statustext_message(why.severity, why.line.encode())
            self._ground.outbox.send(station, [text], writer)

    def _report(self, refused: FrameRefusal, station: GroundStation, frame: MavlinkFrame) -> None:
        """Log a connected station's refusal once for each reason."""
        if refused.is_routine or refused.why in station.reported:
            return
        station.reported.add(refused.why)
        known = MESSAGE_FORMATS.get(frame.msgid)
        name = "{} sysid {} compid {}".format(station.peer, *frame.sender)
        message = str(frame.msgid if known is None else known.name)
        self._emit(GcsRefused(station=name, message=message, why=refused.why))


def _denial(message: Message, sender: Sender) -> Message | None:
    """The protocol's own negative reply to a refused message, if there is one."""
    match message.get_type():
        case "COMMAND_LONG" | "COMMAND_INT":
            denied = CommandResult.DENIED
            return m.MAVLink_command_ack_message(message.command, denied, 0, 0, sender.sysid, sender.compid)
        case "MISSION_COUNT" | "MISSION_ITEM" | "MISSION_ITEM_INT" | "MISSION_CLEAR_ALL" | "MISSION_WRITE_PARTIAL_LIST":
            denied_mission = MissionResult.DENIED
            return m.MAVLink_mission_ack_message(sender.sysid, sender.compid, denied_mission, message.mission_type)
        case "FILE_TRANSFER_PROTOCOL":
            payload = refuse(message.payload)
            if payload is not None:
                return m.MAVLink_file_transfer_protocol_message(0, sender.sysid, sender.compid, payload)
    return None
