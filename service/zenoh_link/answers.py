# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries about the vehicle: state, overview, history, mission/current and mission/list."""

from bridge.bridge import Bridge
from service.daemon.api import DaemonApi
from service.daemon.mission_data import Json, strict
from service.zenoh_link import keys
from service.zenoh_link.history import History
from service.zenoh_link.overview import overview_of
from service.zenoh_link.payload import Payloads, plain
from service.zenoh_link.queries import Answerer, QueryRefused, Question
from service.zenoh_link.vehicle_data import VehicleData, mission_current

_USUAL_LIMIT, _MAX_LIMIT = 20, 200
_MAX_POSITIONS = 1000
_TIMES = ("received_at", "concluded_at")


class Answers:
    """Replies in the encoding of the samples."""

    def __init__(self, data: VehicleData, bridge: Bridge, api: DaemonApi, payloads: Payloads, history: History) -> None:
        self._bridge = bridge
        self._data = data
        self._api = api
        self._payloads = payloads
        self._history = history
        self.answerers: dict[keys.ZenohKey, Answerer] = {
            keys.STATE: self._state,
            keys.OVERVIEW: self._overview,
            keys.HISTORY: self._past,
            keys.MISSION_CURRENT: self._mission_current,
            keys.MISSION_LIST: self._mission_list,
        }

    async def _state(self, question: Question) -> None:
        self._tell(question, keys.STATE, self._data.state())

    async def _overview(self, question: Question) -> None:
        self._tell(question, keys.OVERVIEW, plain(overview_of(self._data.state())))

    async def _past(self, question: Question) -> None:
        most = _whole_number(question, "positions", 0, _MAX_POSITIONS)
        found = await self._history.answer(question.parameter("_time"), most)
        self._tell(question, keys.HISTORY, found | {"missions": [_with_units(each) for each in found["missions"]]})

    async def _mission_current(self, question: Question) -> None:
        self._tell(question, keys.MISSION_CURRENT, mission_current(self._bridge.missions.held))

    async def _mission_list(self, question: Question) -> None:
        limit = _whole_number(question, "limit", _USUAL_LIMIT, _MAX_LIMIT)
        found = (await self._api.list_missions(limit))["missions"]
        self._tell(question, keys.MISSION_LIST, {"missions": [_with_units(mission) for mission in found]})

    def _tell(self, question: Question, key: keys.ZenohKey, body: Json) -> None:
        question.tell(self._payloads.answer(key, body), self._payloads.encoding(key))


def _whole_number(question: Question, name: str, usual: int, most: int) -> int:
    """A parameter's number, greater than 0; `usual` if it is not given."""
    text = question.parameter(name)
    if text is None:
        return usual
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= most):
        raise QueryRefused(f"{name} must be a whole number from 1 to {most}")
    return int(text)


def _with_units(mission: Json) -> Json:
    named = {f"{name}_s" if name in _TIMES else name: value for name, value in mission.items()}
    clean: Json = strict(named)
    return clean
