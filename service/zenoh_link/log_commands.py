# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands @cmd/v1/log: telemetry logs in pieces, for a slow uplink. Commands, because they reveal the flights."""

import base64
import json
import zlib

from payloads import keys
from payloads.mission_data import MOST, Json, whole_number
from service.daemon.telemetry_logs import TelemetryLogs
from service.zenoh_link.queries import Answerer, QueryRefused, Question

_FORM = 'the payload must be {"name": "2026-05-01 10-00-00.tlog", "start": 0}'


class LogQueries:
    """Lists the logs, and reads one piece of one."""

    def __init__(self, logs: TelemetryLogs) -> None:
        self._logs = logs
        self.answerers: dict[keys.ZenohKey, Answerer] = {keys.LOG_LIST: self._list, keys.LOG_READ: self._read}

    async def _list(self, _: Question) -> Json:
        return {"result": await self._logs.list()}

    async def _read(self, question: Question) -> Json:
        try:
            wanted = json.loads(question.payload())
            name, start = wanted["name"], whole_number(wanted, "start", 0, MOST)
        except (ValueError, LookupError, TypeError) as error:
            raise QueryRefused(_FORM) from error
        piece = await self._logs.read(str(name), start)
        # MAVLink halves; its base64 form is a third longer.
        data = base64.b64encode(zlib.compress(piece, 9)).decode()
        return {"result": {"start": start, "size": len(piece), "data": data}}
