# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames received from ground stations. Sans-IO."""

from collections.abc import Callable
from functools import partial

from bridge.gcs.cost import Cost
from bridge.gcs.ground import Ground
from bridge.gcs.guard import Guard, GuardRefusal, Standing, denial
from bridge.gcs.pass_through import PassThrough
from bridge.gcs.station import Peer, Severity, Station
from bridge.vehicle.message_router import MessageRouter
from bridge.vehicle.parameters import Parameters
from protocols.mavlink.codec import MavlinkDecoder
from protocols.mavlink.dialect import Message, messages
from protocols.mavlink.frame import MavlinkFrame
from protocols.mavlink.target import target_of

_AUTOPILOT = messages.MAV_COMP_ID_AUTOPILOT1


class Incoming:
    """Every frame from a ground station passes here: guarded, counted, and answered or passed on.

    `routes` is set while an autopilot that represents itself is on the line; frames then go to it unchanged.
    """

    def __init__(
        self,
        guard: Guard,
        ground: Ground,
        router: MessageRouter,
        parameters: Parameters,
        send_to_autopilot: Callable[[bytes], None],
        sysid: int,
        compid: int,
    ) -> None:
        self._guard = guard
        self._ground = ground
        self._router = router
        self._parameters = parameters
        self._send_to_autopilot = send_to_autopilot
        self._ids = sysid, compid
        self._decoder = MavlinkDecoder()
        self.routes: PassThrough | None = None

    def received(self, peer: Peer, data: bytes, now: float, *, datagram: bool) -> bool:
        """Handle bytes from a ground station; False if they are dropped. A datagram holds whole frames only."""
        if not self._ground.budgets.allows(Cost.RECEIVED, peer, now):
            return False
        for frame in self._ground.received(peer, data, now, datagram=datagram):
            refused = self._guard.refusal(peer, frame)
            if refused is not None and refused.is_forged:
                continue
            if not self._ground.admits(peer, now):
                self._guard.forget(peer)
                return False
            self._ground.heard(peer, frame, now)
            station = Station(peer, frame.sysid, frame.compid)
            if refused is not None:
                self._answer_refused(refused, station, frame)
            elif self.routes is not None:
                self._pass_on(self.routes, station, frame, now)
            else:
                self._ground.record(peer, frame, now)
                if self._router.understands(frame.msgid):
                    message = self._decoder.decode(frame)
                    if message is not None and self._is_for_us(message):
                        self._router.take(station, message, now)
        return True

    def from_autopilot(self, frames: list[MavlinkFrame]) -> None:
        """Pass on frames from the line."""
        if self.routes is not None:
            self.routes.from_autopilot(frames)

    def forget(self, peer: Peer) -> None:
        """A ground station is gone."""
        self._guard.forget(peer)
        if self.routes is not None:
            self.routes.forget(peer)

    def _pass_on(self, routes: PassThrough, station: Station, frame: MavlinkFrame, now: float) -> None:
        """Send a frame on to its targets, within its sender's rights."""
        peer = station.peer
        if not self._ground.budgets.allows(Cost.PASSED, peer, now):
            return
        may_speak_to_others = self._guard.standing(peer) is not Standing.LISTENER
        if not routes.from_station(peer, frame, to_stations=may_speak_to_others):
            self._ground.record(peer, frame, now)
            return
        refused = self._guard.command_refusal(peer, frame)
        if refused is None:
            self._ground.record(peer, frame, now)
            self._send_to_autopilot(frame.raw)
        else:
            self._answer_refused(refused, station, frame)

    def _answer_refused(self, refused: GuardRefusal, station: Station, frame: MavlinkFrame) -> None:
        """Answer a refused frame under the ids that it addressed, if these are the vehicle's."""
        system, component = target_of(frame)
        if self.routes is None:
            answers, is_vehicle = partial(self._ground.to, station), self._is_ours(system, component)
        else:
            asked = self.routes.addressed(system)
            answers = partial(self._ground.to_as, asked or system, component or _AUTOPILOT, station)
            is_vehicle = asked is not None
        if not (is_vehicle and self._ground.allows(station, Cost.ANSWER)):
            return
        message = self._decoder.decode(frame)
        answer = None if message is None else denial(message, station)
        if answer is not None:
            answers(answer)
        elif message is not None and frame.msgid == messages.MAVLINK_MSG_ID_PARAM_SET and self.routes is None:
            # The protocol's answer is the current value.
            self._parameters.send_one(station, message.param_id, -1)
        if refused.is_first:
            answers(messages.MAVLink_statustext_message(Severity.WARNING, f"Refused: {refused.why}".encode()))

    def _is_for_us(self, message: Message) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return self._is_ours(system, component)

    def _is_ours(self, system: int, component: int) -> bool:
        sysid, compid = self._ids
        return system in (0, sysid) and component in (0, compid)
