# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh storage on `fleet/**`: a real one if ZENOHD has the storage manager in its folder, else a model of one."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock

import zenoh

from tests.support.programs import until
from tests.support.zenoh_router import ZENOHD, client

_PLUGIN = "libzenoh_plugin_storage_manager.so"
#: The storage's key in the admin space of its process.
_STATUS = "@/*/router/status/plugins/storage_manager/storages/fleet"


@contextmanager
def storage(folder: Path, endpoint: str) -> Iterator[zenoh.Session]:
    """Run a storage behind a router; yields a session that can query it."""
    with client(endpoint) as looking:
        if ZENOHD is not None and Path(ZENOHD).with_name(_PLUGIN).exists():
            with _zenohd(folder, endpoint, looking):
                yield looking
        else:
            with client(endpoint) as session, _like_a_storage(session):
                yield looking


@contextmanager
def _zenohd(folder: Path, endpoint: str, looking: zenoh.Session) -> Iterator[None]:
    assert ZENOHD is not None
    config = folder / "storage.json5"
    storages = {"fleet": {"key_expr": "fleet/**", "volume": "memory", "complete": True}}
    config.write_text(
        json.dumps(
            {
                "mode": "router",
                "listen": {"endpoints": []},
                "connect": {"endpoints": [endpoint]},
                "scouting": {"multicast": {"enabled": False}},
                "plugins_loading": {"enabled": True, "search_dirs": [str(Path(ZENOHD).parent)]},
                "plugins": {"storage_manager": {"__required__": True, "storages": storages}},
            }
        )
    )
    with (folder / "storage.log").open("wb") as log:
        process = subprocess.Popen([ZENOHD, "-c", str(config)], stdout=log, stderr=log)
    try:
        until(lambda: list(looking.get(_STATUS)) or process.poll(), "the storage")
        assert process.poll() is None, (folder / "storage.log").read_text()
        yield
    finally:
        process.kill()
        process.wait()


@contextmanager
def _like_a_storage(session: zenoh.Session) -> Iterator[None]:
    kept: dict[str, zenoh.Sample] = {}
    lock = Lock()

    def keep(sample: zenoh.Sample) -> None:
        with lock:
            kept[str(sample.key_expr)] = sample

    def answer(query: zenoh.Query) -> None:
        with lock, query:
            for key, sample in kept.items():
                if query.key_expr.intersects(zenoh.KeyExpr(key)):
                    query.reply(key, sample.payload, encoding=sample.encoding, timestamp=sample.timestamp)

    with (
        session.declare_subscriber("fleet/**", keep),
        session.declare_queryable("fleet/**", answer, complete=True),
    ):
        yield
