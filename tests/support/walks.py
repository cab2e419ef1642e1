# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon with a simulated Naze in simulated time, and the functions that each event of its loop calls."""

import asyncio
import select
import socket
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from types import FrameType

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.line.conversation import StoreEffect
from protocols.mavlink.codec import FrameWriter
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkSplitter
from service.daemon.daemon import Daemon
from service.daemon.store_worker import StoreWorker
from service.machine.event_loop import EventLoop, LaneSelector
from service.settings import Settings
from service.settings.addresses import SimulatedFc, parse_gcs
from simulator.board.options import Faults
from simulator.links.pipe_link import SimLink
from simulator.naze.board import SimulatedNaze
from tests.support.packing import pack
from tests.support.programs import free_port
from tests.support.world import MemoryStore

_TIMEOUT_S = 30.0
_POLL_S = 0.001
_ROOT = f"{Path(__file__).parents[2]}/"
_PRODUCT = ("bridge/", "protocols/", "reports/", "service/", "storage/")
#: The event loop's own functions, which a reader of a walk skips.
_SKIPPED = ("service/machine/event_loop.py",)


@dataclass(frozen=True, slots=True)
class Walk:
    """Calls of product functions, calls into a file that was left before, and files."""

    calls: int
    returns: int
    files: int


@dataclass(slots=True)
class WakeUp:
    """One event of the loop: the functions of the daemon that it called, and the messages that it sent."""

    #: File and function, in order.
    called: list[tuple[str, str]] = field(default_factory=list)
    sent: list[Message] = field(default_factory=list)

    @property
    def types(self) -> list[str]:
        """Of the messages sent."""
        return [message.get_type() for message in self.sent]


def measure(*wake_ups: WakeUp) -> Walk:
    """Count over all of them."""
    called = [file for wake_up in wake_ups for file, _ in wake_up.called]
    returns = sum(file != before and file in called[:at] for at, (before, file) in enumerate(pairwise(called), 1))
    return Walk(len(called), returns, len(set(called)))


class _Loop(EventLoop):
    """Waits in simulated time: if no descriptor is ready, the clock jumps to the next timer."""

    def __init__(self) -> None:
        self._now = 0.0
        super().__init__(LaneSelector(self.time, self._wait))

    def time(self) -> float:
        return self._now

    def _wait(
        self, descriptors: Sequence[int], _writers: object, _others: object, seconds: float | None
    ) -> tuple[Sequence[int], object, object]:
        ready = select.select(descriptors, (), (), None if seconds is None else 0.0)
        if not any(ready):
            self._now += seconds or 0.0
        return ready


class TracedDaemon:
    """A daemon on a simulated Naze, and a ground station on its UDP port.

    `wake_ups`: all since the daemon was started, but not the simulator's own.
    """

    def __init__(self, address: tuple[str, int], faults: Faults) -> None:
        self.faults = faults
        self.wake_ups: list[WakeUp] = []
        self._current = WakeUp()
        self._depth = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(address)
        self._socket.setblocking(False)
        self._writer = FrameWriter(255, 190)

    def send(self, message: Message) -> None:
        self._socket.send(self._writer.frame(pack(message), 2))

    async def until(self, done: Callable[[WakeUp], bool]) -> WakeUp:
        """The first wake-up that is `done`; time passes until there is one."""
        loop = asyncio.get_running_loop()
        end = loop.time() + _TIMEOUT_S
        while (found := next(filter(done, self.wake_ups), None)) is None:
            assert loop.time() < end, "simulated time has run out"
            await asyncio.sleep(_POLL_S)
        return found

    async def stay_connected(self) -> None:
        while True:
            self.send(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))
            await asyncio.sleep(1.0)

    def close(self) -> None:
        self._socket.close()

    def profile(self, frame: FrameType, event: str, _argument: object) -> None:
        """For sys.setprofile: note the calls below the daemon's own callbacks."""
        name = frame.f_code.co_filename
        if event not in ("call", "return") or not name.startswith(_ROOT):
            return
        file = name.removeprefix(_ROOT)
        if not file.startswith(_PRODUCT) or file in _SKIPPED:
            return
        if event == "return":
            self._depth -= 1
            if not self._depth and self._current.called[0][0].startswith("service/"):
                # The simulator and the station above call functions of protocols/ themselves.
                self._current.sent += self._received()
                self.wake_ups.append(self._current)
            return
        if not self._depth:
            self._current = WakeUp()
        self._depth += 1
        self._current.called.append((file, frame.f_code.co_qualname))

    def _received(self) -> Iterator[Message]:
        with suppress(BlockingIOError):
            while True:
                for frame in MavlinkSplitter().feed(self._socket.recv(2048)):
                    yield m.MAVLink(None).decode(bytearray(frame.raw))


def run_traced(story: Callable[[TracedDaemon], Awaitable[None]], monkeypatch: pytest.MonkeyPatch) -> None:
    """Run `story` in simulated time. The mission store answers at once, from memory."""
    store, faults = MemoryStore(), Faults()

    def carry_out(_worker: StoreWorker, effect: StoreEffect, answer: Callable[[object], None]) -> None:
        asyncio.get_running_loop().call_soon(answer, store.carry_out(effect))

    async def main() -> None:
        link = SimLink(SimulatedNaze(faults=faults), asyncio.get_running_loop())
        monkeypatch.setattr("service.daemon.fc_connection.device_opener", lambda _address: link.start)
        monkeypatch.setattr(StoreWorker, "carry_out", carry_out)
        port = free_port(socket.SOCK_DGRAM)
        daemon = Daemon(Settings(SimulatedFc(), gcs=[parse_gcs(f"udpin:127.0.0.1:{port}")]))
        traced = TracedDaemon(("127.0.0.1", port), faults)
        running = asyncio.create_task(daemon.run())
        await daemon.started.wait()
        connected = asyncio.create_task(traced.stay_connected())
        sys.setprofile(traced.profile)
        try:
            await story(traced)
        finally:
            sys.setprofile(None)
            connected.cancel()
            running.cancel()
            await asyncio.wait([connected, running])
            traced.close()

    with asyncio.Runner(loop_factory=_Loop) as runner:
        runner.run(main())
