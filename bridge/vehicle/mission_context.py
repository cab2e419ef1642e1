# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of the bridge that work on missions shares."""

from dataclasses import dataclass

from bridge.gcs.station import Post
from bridge.line.runner import Runner
from bridge.missions.mission_service import MissionService
from bridge.model.events import EventLog, Incidents
from bridge.model.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class MissionContext:
    """`post`: sends messages to ground stations."""

    missions: MissionService
    runner: Runner
    post: Post
    vehicle: Vehicle
    log_event: EventLog
    incidents: Incidents
