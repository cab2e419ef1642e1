# SPDX-License-Identifier: GPL-3.0-or-later
"""A push of 146 records at 115200 baud, compared with the time of its bare bytes at line rate.

The daemon (`Daemon`, with its own port, links and timers) runs on this process's event loop; the simulated
Naze runs in another process behind a pseudo-terminal and keeps the pace of the UART both ways. The clock is read within
the conversation: it starts when the push hands over its first CHUNK, just before that frame's first byte is written,
and stops when the push has checked the reply to COMMIT, whose checksum the flight controller computed over its flash.
So nothing between daemon and terminal can cost or save time, and the figure includes encoding and wake-ups.

Flash stalls are excluded by a simulated flash that takes no time to program a record (BEGIN, which erases, comes before
the clock starts). Another figure includes the real flash's time: most of that overlaps with the line, except for the
last chunk.
"""

import asyncio
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.missions import COUNT, random_mission
from benchmarks.processes import BenchmarkError, simulated_naze
from bridge.controllers.harakiri.check import HarakiriRules
from bridge.line.conversation import Conversation, LinkLost, Send
from bridge.missions.fc_mission_store import PushResult
from bridge.missions.list_check import check_list
from bridge.model.missions import Refusal
from protocols.msp.mission import RECORD_SIZE, MissionCommand, WpRecord
from service.daemon.daemon import Daemon
from service.machine import event_loop
from service.settings import Settings
from service.settings.addresses import GcsAddress, SerialFc
from tests.support.inside import inside
from tests.support.programs import free_port

_BAUD = 115200
_RUNS = 20
_LINE_S = COUNT * RECORD_SIZE * 10 / _BAUD


def measure() -> list[Figure]:
    """Measure `_RUNS` pushes of different lists, without and with the flash's own time."""
    floor = Floor(_LINE_S * 1000, f"{COUNT} * {RECORD_SIZE} bytes at {_BAUD} 8N1")
    bare, whole = _times_ms("--program-stall", "0"), _times_ms()
    name = f"push of {COUNT} records, {_RUNS} runs"
    return [
        Figure(f"{name}, median", statistics.median(bare), "ms", floor, 1.10, times_floor=True),
        Figure(f"{name}, worst", max(bare), "ms", floor),
        Figure(f"{name}, flash stall included, median", statistics.median(whole), "ms", floor),
        Figure(f"{name}, flash stall included, worst", max(whole), "ms", floor),
    ]


def _times_ms(*options: str) -> list[float]:
    with tempfile.TemporaryDirectory() as name, simulated_naze(Path(name), "--baud", str(_BAUD), *options) as board:
        return [seconds * 1000 for seconds in event_loop.run(_push_all(board.link))]


async def _push_all(link: Path) -> list[float]:
    settings = Settings(SerialFc(str(link), _BAUD), [GcsAddress("udpout", "127.0.0.1", free_port())])
    daemon = Daemon(settings)
    running = asyncio.create_task(daemon.run())
    try:
        while isinstance(inside(daemon.bridge).missions.fc_store, Refusal):  # noqa: ASYNC110 - only the daemon's log says so
            await asyncio.sleep(0.01)
        return [await _push(daemon, _records(seed)) for seed in range(_RUNS)]
    finally:
        running.cancel()
        await asyncio.wait([running])


def _records(seed: int) -> tuple[WpRecord, ...]:
    records = check_list(random_mission(seed), HarakiriRules()).records
    assert len(records) == COUNT
    return records


async def _push(daemon: Daemon, records: tuple[WpRecord, ...]) -> float:
    """Push one list; returns the seconds from the first CHUNK to the verified checksum."""
    loop = asyncio.get_running_loop()
    fc_store = inside(daemon.bridge).missions.fc_store
    assert not isinstance(fc_store, Refusal)
    begun_at: list[float] = []
    done: asyncio.Future[tuple[PushResult | LinkLost, float]] = loop.create_future()
    push = _noting_first_chunk(fc_store.push(records, lambda _: None), lambda: begun_at.append(loop.time()))
    inside(daemon.bridge).runner.start(push, lambda result, _: done.set_result((result, loop.time())), loop.time())
    daemon.flush()
    result, ended_at = await done
    if isinstance(result, LinkLost) or result.failure or result.unchanged:
        raise BenchmarkError(f"the push ended with {result}")
    return ended_at - begun_at[0]


def _noting_first_chunk(push: Conversation[PushResult], note: Callable[[], None]) -> Conversation[PushResult]:
    """Pass the conversation through, and call `note` at its first CHUNK."""
    noted = False
    effect = next(push)
    while True:
        if not noted and isinstance(effect, Send) and effect.command == MissionCommand.CHUNK:
            noted = True
            note()
        answer = yield effect
        try:
            effect = push.send(answer)
        except StopIteration as stop:
            result: PushResult = stop.value
            return result
