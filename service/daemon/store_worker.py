# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission store on its own thread: a slow SD card never delays the links."""

import asyncio
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import structlog

from bridge.line.conversation import Conclude, FindPending, NoteReader, Recall, Save, StoreEffect
from bridge.model.missions import ArrivedMission, PendingMission, RecalledMission
from bridge.model.settings import TakenBackup
from payloads.mission_data import plain
from protocols.mission_item import ListIdentity, identify, pack_records
from service.machine.threads import BackgroundThread, post
from storage.mission_store import MissionStore, ReceivedMission, open_store, store_in_memory
from storage.store_error import StoreError

DATABASE_NAME = "missions.db"
#: For the last jobs: a hanging disk must not keep the daemon from ending.
_CLOSE_TIMEOUT_S = 2.0
#: For a query, whose sender waits for 8 s (the page) or 10 s (zenoh).
_TIMEOUT_S = 5.0
T = TypeVar("T")
_log = structlog.get_logger()


class StoreWorker:
    """Carries out the bridge's store effects in order. Without a `directory` it does not store anything.

    In an unusable directory missions are kept in memory. `on_trouble` gets the reason, on the event loop.
    """

    def __init__(self, directory: Path | None, on_trouble: Callable[[str], None] = lambda _why: None) -> None:
        self._on_trouble = on_trouble
        self._thread = BackgroundThread("store", _TIMEOUT_S)
        self._loop = asyncio.get_running_loop()
        self._store: MissionStore | None = None
        #: The file, or None while missions are kept in memory.
        self._path: Path | None = None
        if directory is not None:
            self._thread.submit(partial(self._open, directory))

    def carry_out(self, effect: StoreEffect, answer: Callable[[object], None]) -> None:
        """Run an effect on the worker's thread. `answer` is called on the event loop."""

        def work() -> None:
            post(self._loop, answer, self._do(effect))

        self._thread.submit(work)

    def back_up(self, board: str, backup: TakenBackup) -> None:
        """Store a table of settings, if it has changed."""

        def work() -> None:
            if self._store is None:
                return
            try:
                self._store.backups.add(board, backup.board.kind, backup.values, time.time(), backup.occasion.value)
            except StoreError as error:
                _log.error("store.failed", why=str(error))

        self._thread.submit(work)

    async def ask(self, question: Callable[[MissionStore], T]) -> T:
        """Run a query on the store. Raises StoreError if there is no store, it fails or does not answer in time."""

        def work() -> T:
            if self._store is None:
                raise StoreError("no missions are stored here: start the daemon with --state-dir DIR")
            return question(self._store)

        try:
            return await self._thread.ask(work)
        except TimeoutError as error:
            raise StoreError(f"the mission store: {error}") from error

    def close(self) -> None:
        """Finish the queued jobs, then close; gives up on a hanging disk."""
        self._thread.submit(self._close)
        if not self._thread.close(_CLOSE_TIMEOUT_S):
            _log.error("store.hangs", what="the disk does not answer; the last outcome may be missing")

    def _open(self, directory: Path) -> None:
        try:
            opened = open_store(directory / DATABASE_NAME, time.time())
        except StoreError as error:
            _log.error("store.unavailable", why=str(error), what="missions are kept in memory until the daemon exits")
            self._store = store_in_memory()
            post(self._loop, self._on_trouble, str(error))
            return
        self._store, self._path = opened.store, directory / DATABASE_NAME
        if opened.set_aside is not None:
            what = f"a new mission store was created with the {opened.salvaged} missions that could be read"
            _log.error("store.damaged", kept_as=str(opened.set_aside), what=what)

    def _close(self) -> None:
        if self._store is None:
            return
        try:
            self._store.close()
        except StoreError as error:
            _log.error("store.failed", why=str(error))
        if self._path is not None and not os.path.exists(self._path):
            _log.error("store.failed", why=f"{self._path} was removed while in use: its missions are lost")

    def _do(self, effect: StoreEffect) -> object:
        nothing: object = RecalledMission() if isinstance(effect, Recall) else None
        if self._store is None:
            return nothing
        try:
            match effect:
                case Save(mission):
                    return self._store.add(_received(mission), mission.sender)
                case Conclude(number, outcome, detail):
                    self._store.conclude(number, outcome.value, detail, time.time())
                    return True
                case Recall(identity):
                    found = self._store.latest_verified(identity.count, identity.checksum)
                    if found is None:
                        return None
                    numbers = self._store.item_numbers(identity.count, identity.checksum)
                    sent_seqs = {sender: tuple(seqs) for sender, seqs in numbers.items()}
                    return RecalledMission(found.received.roi_commands, sent_seqs)
                case NoteReader(identity, reader):
                    self._store.note_reader(identity.count, identity.checksum, reader)
                case FindPending():
                    return [
                        PendingMission(
                            mission.number,
                            None
                            if mission.verdict == "REJECTED"
                            else ListIdentity(mission.record_count, mission.checksum),
                        )
                        for mission in self._store.pending()
                    ]
        except StoreError as error:
            _log.error("store.failed", why=str(error))
        return nothing


def _received(mission: ArrivedMission) -> ReceivedMission:
    verdict = mission.verdict
    identity = identify(verdict.records)
    return ReceivedMission(
        received_at=time.time(),
        source=mission.source,
        items=list(map(plain, mission.items)),
        verdict=verdict.result.name,
        ack=f"MAV_MISSION_{verdict.ack.name}",
        findings=list(map(plain, verdict.findings)),
        stored_items=list(map(plain, verdict.items)),
        records=pack_records(verdict.records),
        record_count=identity.count,
        checksum=identity.checksum,
        roi_commands=dict(verdict.sent_as),
        sent_seqs=list(verdict.sent_seqs),
    )
