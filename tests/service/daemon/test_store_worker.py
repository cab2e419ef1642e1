# SPDX-License-Identifier: GPL-3.0-or-later
"""Every request to a hung disk gets an error in time: waiting ones would hold all places of the page or of zenoh."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import pytest

from service.daemon import store_worker
from service.daemon.api import DaemonApi
from service.daemon.store_worker import StoreWorker
from service.zenoh_link import history
from service.zenoh_link.history import History
from storage.store_error import StoreError

HANGS = "the disk does not answer"
LOG = "2026-01-02 03-04-05.tlog"


@contextmanager
def hung_file(path: Path) -> Iterator[None]:
    """A file that cannot be opened for reading before the end."""
    os.mkfifo(path)
    try:
        yield
    finally:
        os.close(os.open(path, os.O_RDWR))  # the reader's open() returns


async def test_the_mission_store(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_worker, "_TIMEOUT_S", 0.01)
    hangs = threading.Event()
    store = StoreWorker(None)
    store._thread.submit(hangs.wait)
    with pytest.raises(StoreError, match=HANGS):
        await store.ask(lambda store: store.list(1))
    hangs.set()
    store.close()


async def test_the_history_over_zenoh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Api:
        async def missions_between(self, *_: Any) -> dict[str, Any]:
            return {"missions": []}

    monkeypatch.setattr(history, "_TIMEOUT_S", 0.01)
    past = History(cast("DaemonApi", Api()), tmp_path, lambda: 0.0)
    with hung_file(tmp_path / LOG), pytest.raises(TimeoutError, match=HANGS):
        await past.answer("[..]", 0)
