# SPDX-License-Identifier: GPL-3.0-or-later
"""Every request to a hung disk gets an error in time: waiting ones would hold all places of the page or of zenoh."""

import threading

import pytest

from service.daemon import store_worker
from service.daemon.store_worker import StoreWorker
from storage.store_error import StoreError


async def test_the_mission_store(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_worker, "_TIMEOUT_S", 0.01)
    hangs = threading.Event()
    store = StoreWorker(None)
    store._thread.submit(hangs.wait)
    with pytest.raises(StoreError, match="the disk does not answer"):
        await store.ask(lambda store: store.list(1))
    hangs.set()
    store.close()
