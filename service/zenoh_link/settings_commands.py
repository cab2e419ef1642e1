# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands about the flight controller's settings below @cmd."""

from collections.abc import Callable

from payloads import keys
from payloads.mission_data import ACCEPTED, Json
from protocols.param_file import ParamFile, ParamFileError, read_param_file
from service.daemon.settings_api import SettingsApi
from service.zenoh_link.queries import Answerer, QueryRefused, Question

_PAYLOAD = "the query's payload"
#: INAV's 650 settings are 20 KB.
_MAX_BYTES = 1 << 18


class SettingsQueries:
    """Handles the commands through SettingsApi. `alone`: refuses a command if another bridge gets it, too."""

    def __init__(self, api: SettingsApi, alone: Callable[[Answerer], Answerer]) -> None:
        self._api = api
        self.answerers: dict[keys.ZenohKey, Answerer] = {
            keys.SETTINGS_LIST: self._list,
            keys.SETTINGS_PLAN: self._plan,
            keys.SETTINGS_RESTORE: alone(self._restore),
        }

    async def _list(self, _: Question) -> Json:
        table = await self._api.table()
        values = {setting["name"]: setting["value"] for setting in table["settings"]}
        return {"result": {"board": table["board"], "values": values}}

    async def _plan(self, question: Question) -> Json:
        file = _file(question)
        return {"result": await self._api.plan(file.values, file.board)}

    async def _restore(self, question: Question) -> Json:
        file = _file(question)
        question.send({"progress": 0, "of": len(file.values)})
        total = len((await self._api.plan(file.values, file.board))["changes"])

        def progress(so_far: Json) -> None:
            question.send(so_far | {"of": total})

        result = await self._api.restore(file.values, file.board, "zenoh", progress)
        if not result["is_saved"] or result["left_out"]:
            raise QueryRefused(result["text"], result)
        return {"result": {"ack": ACCEPTED} | result}


def _file(question: Question) -> ParamFile:
    if question.size > _MAX_BYTES:
        raise QueryRefused(f"{_PAYLOAD} is larger than {_MAX_BYTES >> 10} KiB: send a .param file")
    try:
        return read_param_file(question.payload(), _PAYLOAD)
    except ParamFileError as error:
        raise QueryRefused(str(error)) from None
