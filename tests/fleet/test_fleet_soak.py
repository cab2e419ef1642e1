# SPDX-License-Identifier: GPL-3.0-or-later
"""Real daemons whose network to the router is cut again and again: nothing is lost, and the list is right afterwards.

FLEET_DAEMONS=50 FLEET_CUTS=5 is `make soak`'s size.
"""

import asyncio
import os
import random
import threading
import time
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path
from socket import SOCK_STREAM
from typing import Any

import pytest
from zenoh import ext

from tests.support.fleet_bench import Fleet
from tests.support.plan import plain_plan
from tests.support.programs import free_port, until
from tests.support.zenoh_bench import body

DAEMONS, CUTS = int(os.environ.get("FLEET_DAEMONS", "4")), int(os.environ.get("FLEET_CUTS", "1"))
_AT_ONCE = 5
#: Longer than zenoh's lease of 10 s: both ends give the session up.
_CUT_S = 12.0


class Network(threading.Thread):
    """Connections to the router that can be cut: packets are lost, or, as behind a NAT that restarts, it is reset."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(daemon=True)
        self._host, _, self._to = endpoint.partition("/")[2].rpartition(":")
        self.port = free_port(SOCK_STREAM)
        self._links: set[tuple[asyncio.StreamWriter, asyncio.StreamWriter]] = set()
        self._cut: set[asyncio.StreamWriter] = set()
        self._is_cut = False
        self._is_up = threading.Event()
        self.start()
        self._is_up.wait()

    def run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._is_over = asyncio.get_running_loop(), asyncio.Event()
        server = await asyncio.start_server(self._connected, "127.0.0.1", self.port)
        self._is_up.set()
        async with server:
            await self._is_over.wait()

    def cut(self, share: random.Random) -> None:
        """Lose everything on half of the connections from now on, reset a quarter, and admit no new ones."""

        def act() -> None:
            self._is_cut = True
            for link in [*self._links]:
                chance = share.random()
                if chance < 0.5:
                    self._cut.update(link)
                elif chance < 0.75:
                    for end in link:
                        end.transport.abort()

        self._loop.call_soon_threadsafe(act)

    def mend(self) -> None:
        """What was sent meanwhile is lost, and with it the connection."""

        def act() -> None:
            self._is_cut = False
            for end in self._cut:
                end.transport.abort()
            self._cut.clear()

        self._loop.call_soon_threadsafe(act)

    def end(self) -> None:
        self._loop.call_soon_threadsafe(self._is_over.set)
        self.join()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            if self._is_cut:
                raise ConnectionError
            far_reader, far_writer = await asyncio.open_connection(self._host, int(self._to))
        except OSError:
            writer.transport.abort()
            return
        link = writer, far_writer
        self._links.add(link)
        await asyncio.gather(self._pass(reader, far_writer), self._pass(far_reader, writer))
        self._links.discard(link)

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await reader.read(1 << 16):
                if writer not in self._cut:
                    writer.write(data)
        except ConnectionError:
            pass
        finally:
            writer.transport.abort()


@pytest.mark.timeout(120 + 10 * DAEMONS + 60 * CUTS)
def test_everything_arrives_after_network_cuts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [f"naze-{number}" for number in range(DAEMONS)]
    share = random.Random(1)
    with ExitStack() as stack:
        fleet = Fleet(tmp_path, stack)
        near, network = fleet.router.endpoint, Network(fleet.router.endpoint)
        stack.callback(network.end)
        fleet.router.endpoint = f"tcp/127.0.0.1:{network.port}"  # for the vehicles alone
        for first in range(0, DAEMONS, _AT_ONCE):
            for name in names[first : first + _AT_ONCE]:
                fleet.start(name)
            fleet.wait(*names[: first + _AT_ONCE])
        fleet.router.endpoint = near
        heard: dict[str, list[Any]] = defaultdict(list)

        def take(sample: Any) -> None:
            heard[str(sample.key_expr)].append(body(sample))

        follower = [
            ext.declare_advanced_subscriber(
                fleet.session,
                f"fleet/*/v1/{suffix}",
                take,
                history=ext.HistoryConfig(detect_late_publishers=True),
                recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            )
            for suffix in ("event", "mission/report")
        ]
        until(lambda: all(heard[f"fleet/{name}/v1/event"] for name in names), "earlier events")
        slowest_s = 0.0
        for cut in range(CUTS):
            network.cut(share)
            end = time.monotonic() + _CUT_S
            for name in names:
                fleet.daemons[name].push(plain_plan(5 + cut))
            time.sleep(max(0.0, end - time.monotonic()))
            network.mend()
            mended_at = time.monotonic()
            until(
                lambda count=5 + cut: [each["mission_count"] for each in fleet.listed().values()] == [count] * DAEMONS,  # type: ignore[misc]
                "all vehicles with their new mission",
            )
            slowest_s = max(slowest_s, time.monotonic() - mended_at)

        def reports() -> dict[str, list[int]]:
            return {name: [len(each["sent"]) for each in heard[f"fleet/{name}/v1/mission/report"]] for name in names}

        until(lambda: reports() == {name: [5 + cut for cut in range(CUTS)] for name in names}, "all reports")
        for name in names:
            numbers = [event["seq"] for event in heard[f"fleet/{name}/v1/event"]]
            assert numbers == list(range(len(numbers))), name
            assert fleet.daemons[name].is_alive
        del follower
    with capsys.disabled():
        print(  # noqa: T201
            f"\n{DAEMONS} daemons, {CUTS} cuts of {_CUT_S:.0f} s: all listed at most {slowest_s:.1f} s after a cut"
        )
