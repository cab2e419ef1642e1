# SPDX-License-Identifier: GPL-3.0-or-later
"""A restore that goes on while nobody waits for it: a phone that loses the Wi-Fi finds its end on the page."""

import asyncio
from http import HTTPStatus

from service.api import ControlError, MissionJobs
from service.mission_data import Json
from service.web.access import Refused
from storage.store_error import StoreError


class Restoring:
    """One restore at a time. `state`: the present or last one as the page shows it, None before the first."""

    def __init__(self, jobs: MissionJobs) -> None:
        self._jobs = jobs
        self._task: asyncio.Task[None] | None = None
        self.state: Json | None = None

    def begin(self, number: int) -> None:
        """Begin to restore a mission; Refused if that is impossible at this moment."""
        if self._task is not None and not self._task.done():
            raise Refused(HTTPStatus.CONFLICT, "A mission is being restored already.")
        state: Json = {"mission": number, "records": 0, "done": False, "ok": False, "text": ""}
        self.state = state
        self._task = asyncio.get_running_loop().create_task(self._restore(number, state))

    async def close(self) -> None:
        """Wait no more for the answer; the daemon has ended the transfer itself."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _restore(self, number: int, state: Json) -> None:
        def progress(told: Json) -> None:
            state["records"] = told["progress"]

        try:
            answer = await self._jobs.restore(number, progress)
            state |= {"ok": answer["ack"] == "MAV_MISSION_ACCEPTED", "text": answer["text"]}
        except (ControlError, StoreError, ValueError) as error:
            state["text"] = str(error)
        finally:
            state["done"] = True
