# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries about the vehicle, and the commands below @cmd: those of the command line, sent as queries.

docs/zenoh-payloads.md describes the bodies.
"""

import asyncio
import base64
import json
import zlib
from collections.abc import Callable, Set
from dataclasses import asdict
from typing import TypeVar

from bridge.bridge import Bridge
from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.missions import ArrivedMission
from payloads import keys
from payloads.mission_data import ACCEPTED, MAX_ITEMS, MOST, Json, plain, strict, whole_number
from payloads.overview import overview_of
from protocols.mission_file import read_mission_file
from protocols.mission_item import MissionItem
from protocols.param_file import ParamFile, read_param_file
from protocols.plain_text import FileError
from service.daemon.api import DaemonApi, delivery_data
from service.daemon.telemetry_logs import TelemetryLogs
from service.zenoh_link.queries import Answerer, QueryRefused, Question
from service.zenoh_link.session import RENAME

#: Missions in a list, the newest.
_LISTED = 50
_TIMES = ("received_at", "concluded_at")
_PAYLOAD = "the query's payload"
#: Larger files are read by the command line only, not alongside a running link. A mission that fits has about 20 KB,
#: and so have the 650 settings of an INAV.
_MAX_BYTES = 1 << 18
#: Parsed on the event loop. A text this short cannot be nested too deeply either.
_MAX_LOG_REQUEST = 256
_LOG_FORM = 'the payload must be {"name": "2026-05-01 10-00-00.tlog", "start": 0}'
T = TypeVar("T")


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

    async def _mission_list(self, _: Question) -> Json:
        found = (await self._api.list_missions(_LISTED))["missions"]
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


class CommandQueries:
    """Handles the commands through DaemonApi, like all other interfaces. `others`: bridges with the same name.

    They also get each command, so none that changes a mission or settings is executed. Telemetry logs are read by
    commands, because they reveal the flights.
    """

    def __init__(self, api: DaemonApi, others: Set[str], logs: TelemetryLogs) -> None:
        self._api = api
        self._others = others
        self._logs = logs
        #: Parsing takes about 50 times the file's size in memory.
        self._one_at_a_time = asyncio.Lock()
        self.answerers: dict[keys.ZenohKey, Answerer] = {
            keys.UPLOAD: self._alone(self._upload),
            keys.CHECK: self._check,
            keys.CLEAR: self._alone(self._clear),
            keys.STATUS: self._status,
            keys.SETTINGS_LIST: self._list_settings,
            keys.SETTINGS_PLAN: self._plan_settings,
            keys.SETTINGS_RESTORE: self._alone(self._restore_settings),
            keys.LOG_LIST: self._list_logs,
            keys.LOG_READ: self._read_log,
        }

    def _alone(self, answerer: Answerer) -> Answerer:
        async def answer(question: Question) -> Json:
            if self._others:
                raise QueryRefused(f"another bridge has the same vehicle name: {RENAME}")
            return await answerer(question)

        return answer

    async def _upload(self, question: Question) -> Json:
        items = await self._items(question)
        # A file without a storable item must not erase the missions of a fleet.
        return _end(await self._api.push(items, "zenoh upload", _progress_of(question, len(items)), may_erase=False))

    async def _check(self, question: Question) -> Json:
        return {"result": await self._api.check(await self._items(question))}

    async def _clear(self, _: Question) -> Json:
        return _end(await self._api.push([], "zenoh clear", lambda _: None))

    async def _status(self, _: Question) -> Json:
        return {"result": self._api.status()}

    async def _list_settings(self, _: Question) -> Json:
        table = await self._api.settings.table()
        values = {setting["name"]: setting["value"] for setting in table["settings"]}
        return {"result": {"board": table["board"], "values": values}}

    async def _plan_settings(self, question: Question) -> Json:
        file = await self._param_file(question)
        return {"result": await self._api.settings.plan(file.values, file.board)}

    async def _restore_settings(self, question: Question) -> Json:
        file = await self._param_file(question)
        question.send({"progress": 0, "of": len(file.values)})
        total = len((await self._api.settings.plan(file.values, file.board))["changes"])
        result = await self._api.settings.restore(file.values, file.board, "zenoh", _progress_of(question, total))
        if not result["is_saved"] or result["left_out"]:
            raise QueryRefused(result["text"], result)
        return {"result": {"ack": ACCEPTED} | result}

    async def _list_logs(self, _: Question) -> Json:
        return {"result": await self._logs.list()}

    async def _read_log(self, question: Question) -> Json:
        """One piece, for a slow uplink."""
        if question.size > _MAX_LOG_REQUEST:
            raise QueryRefused(_LOG_FORM)
        try:
            wanted = json.loads(question.payload())
            name, start = wanted["name"], whole_number(wanted, "start", 0, MOST)
        except (ValueError, LookupError, TypeError) as error:
            raise QueryRefused(_LOG_FORM) from error
        piece = await self._logs.read(str(name), start)
        # MAVLink halves. Its base64 form is a third longer.
        data = base64.b64encode(await asyncio.to_thread(zlib.compress, piece, 9)).decode()
        return {"result": {"start": start, "size": len(piece), "data": data}}

    async def _items(self, question: Question) -> list[MissionItem]:
        """Parse the mission in the payload, with the formats, reader and messages of `naze-bridge check`."""
        items = await self._read(read_mission_file, question, "mission")
        if not items:
            raise QueryRefused(f"{_PAYLOAD} holds no mission; mission/clear clears the one on the craft")
        if len(items) > MAX_ITEMS:
            held = f"{_PAYLOAD} holds {len(items)} items"
            raise QueryRefused(f"{held}, more than any flight controller stores: shorten it")
        return items

    async def _param_file(self, question: Question) -> ParamFile:
        return await self._read(read_param_file, question, ".param")

    async def _read(self, reader: Callable[[bytes, str], T], question: Question, kind: str) -> T:
        """Read the file in the payload, not on the event loop."""
        if question.size > _MAX_BYTES:
            raise QueryRefused(f"{_PAYLOAD} is larger than {_MAX_BYTES >> 10} KiB: send a {kind} file")
        try:
            async with self._one_at_a_time:
                return await asyncio.to_thread(reader, question.payload(), _PAYLOAD)
        except FileError as error:
            raise QueryRefused(str(error)) from None


def _progress_of(question: Question, count: int) -> Callable[[Json], None]:
    """A function that reports the progress towards `count` records."""
    return lambda progress: question.send(progress | {"of": count})


def _end(answer: Json) -> Json:
    if answer["ack"] != ACCEPTED:
        raise QueryRefused(answer["text"], answer)
    return {"result": answer}
