# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes that the page started. They continue without it: after a Wi-Fi dropout the page still finds the result."""

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from http import HTTPStatus

from service.control.client import ControlError
from service.control.mission_data import Json
from service.web.access import Refused
from storage.store_error import StoreError

Progress = Callable[[Json], None]


class MissionWriter:
    """One write at a time. `state`: the present or latest one as the page shows it, None before the first."""

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None
        self.state: Json | None = None

    def begin(self, what: str, write: Callable[[Progress], Awaitable[Json]]) -> str:
        """Start writing; returns the write's id, by which the page knows its own result. Refused: one is running."""
        if self._task is not None and not self._task.done():
            raise Refused(HTTPStatus.CONFLICT, "Another mission is being written: wait until it has finished.")
        state: Json = {"id": secrets.token_hex(8), "what": what, "records": 0, "done": False, "ok": False, "text": ""}
        self.state = state
        self._task = asyncio.get_running_loop().create_task(self._run(write, state))
        return str(state["id"])

    async def close(self) -> None:
        """Stop waiting for the result; the daemon itself has ended the transfer."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self, write: Callable[[Progress], Awaitable[Json]], state: Json) -> None:
        def progress(told: Json) -> None:
            state["records"] = told["progress"]

        try:
            answer = await write(progress)
            state |= {"ok": answer["ack"] == "MAV_MISSION_ACCEPTED", "text": answer["text"]}
        except (ControlError, StoreError, ValueError) as error:
            state["text"] = str(error)
        finally:
            state["done"] = True
