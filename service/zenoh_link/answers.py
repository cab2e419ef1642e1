# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries about the vehicle: state, overview, mission/current and mission/list.

docs/zenoh-payloads.md describes the bodies.
"""

from collections.abc import Callable
from dataclasses import asdict

from bridge.bridge import Bridge
from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.missions import ArrivedMission
from payloads import keys
from payloads.mission_data import Json, plain, strict
from payloads.overview import overview_of
from service.daemon.api import DaemonApi, delivery_data
from service.zenoh_link.queries import Answerer, Question

_USUAL_LIMIT, _MAX_LIMIT = 20, 200
_TIMES = ("received_at", "concluded_at")


class Answers:
    """The bodies of the replies. `state`: the vehicle's, as published."""

    def __init__(self, state: Callable[[], Json], bridge: Bridge, api: DaemonApi) -> None:
        self._bridge = bridge
        self._vehicle_state = state
        self._api = api
        self.answerers: dict[keys.ZenohKey, Answerer] = {
            keys.STATE: self._state,
            keys.OVERVIEW: self._overview,
            keys.MISSION_CURRENT: self._mission_current,
            keys.MISSION_LIST: self._mission_list,
        }

    async def _state(self, _: Question) -> Json:
        return self._vehicle_state()

    async def _overview(self, _: Question) -> Json:
        return plain(overview_of(self._vehicle_state()))

    async def _mission_current(self, _: Question) -> Json:
        return mission_current(self._bridge.missions.held)

    async def _mission_list(self, question: Question) -> Json:
        limit = question.whole_number("limit", _USUAL_LIMIT, _MAX_LIMIT)
        found = (await self._api.list_missions(limit))["missions"]
        return {"missions": [_with_units(mission) for mission in found]}


def mission_current(held: HeldMission | None) -> Json:
    if held is None:
        return {"count": None, "checksum": None, "items": None}
    return {
        "count": held.identity.count,
        "checksum": f"{held.identity.checksum:08x}",
        "items": [strict(asdict(item)) for item in held.items],
    }


def mission_report(mission: ArrivedMission, delivery: DeliveryResult) -> Json:
    body: Json = strict(delivery_data(delivery, mission) | {"source": mission.source})
    return body


def _with_units(mission: Json) -> Json:
    named = {f"{name}_s" if name in _TIMES else name: value for name, value in mission.items()}
    clean: Json = strict(named)
    return clean
