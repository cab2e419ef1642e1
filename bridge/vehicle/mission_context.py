# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of the bridge that work on missions shares."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from bridge.gcs.ground import Ground
from bridge.gcs.station import Severity, Station
from bridge.line.conversation import Conversation, LinkLost, Stopped
from bridge.line.runner import Runner
from bridge.missions.mission_service import NO_LINK, STOPPING, MissionService
from bridge.model.events import EventLog, Incidents
from bridge.model.refusal import Refusal
from bridge.model.vehicle import Vehicle
from protocols.mavlink.dialect import messages
from protocols.mission_item import MissionResult

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class MissionContext:
    """`ground`: sends messages to ground stations."""

    missions: MissionService
    runner: Runner
    ground: Ground
    vehicle: Vehicle
    log_event: EventLog
    incidents: Incidents

    def run(
        self, conversation: Conversation[T | Refusal], on_done: Callable[[T | Refusal, float], None], now: float
    ) -> None:
        """Run a conversation; `on_done` gets its result and the time. A lost line is a refusal, too."""

        def done(result: T | Refusal | LinkLost, at: float) -> None:
            if isinstance(result, LinkLost):
                result = STOPPING if isinstance(result, Stopped) else NO_LINK
            on_done(result, at)

        self.runner.start(conversation, done, now)

    def ack(self, station: Station, result: MissionResult) -> None:
        self.ground.to(station, messages.MAVLink_mission_ack_message(station.sysid, station.compid, result))

    def refuse(self, station: Station, refusal: Refusal) -> None:
        """Send the reason as a text, and a MISSION_ACK."""
        self.ground.say(Severity.ERROR, refusal.text, station)
        self.ack(station, refusal.ack)
