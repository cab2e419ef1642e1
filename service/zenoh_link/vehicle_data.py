# SPDX-License-Identifier: GPL-3.0-or-later
"""The plain data published at each key: the bodies of docs/zenoh.md's payloads."""

from dataclasses import asdict

from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.events import BridgeEvent
from bridge.model.mission_log import ArrivedMission
from payloads.mission_data import Json, strict
from payloads.payload import plain
from service.daemon.api import delivery_data
from service.daemon.daemon import Daemon
from service.zenoh_link.time_source import SampleClock


class VehicleData:
    """Reads the daemon's bridge. `others`: bridges with the same name."""

    def __init__(self, vehicle: str, daemon: Daemon, others: set[str], clock: SampleClock) -> None:
        self._vehicle = vehicle
        self._daemon = daemon
        self._others = others
        self._clock = clock

    def state(self) -> Json:
        return {
            "vehicle": self._vehicle,
            "others_of_this_name": len(self._others),
            "time_source": self._clock.source(self._daemon.bridge.vehicle),
            **plain(self._daemon.report()),
        }


def mission_current(held: HeldMission | None) -> Json:
    if held is None:
        return {"count": None, "checksum": None, "items": None}
    return {
        "count": held.identity.count,
        "checksum": f"{held.identity.checksum:08x}",
        "items": [strict(asdict(item)) for item in held.items],
    }


def event_data(event: BridgeEvent) -> Json:
    return {"level": event.level, "event": event.name_in_log, "facts": event.facts()}


def mission_report(mission: ArrivedMission, delivery: DeliveryResult) -> Json:
    body: Json = strict(delivery_data(delivery, mission) | {"source": mission.source})
    return body
