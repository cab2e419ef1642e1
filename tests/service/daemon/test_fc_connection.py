# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of the bridge itself while the flight controller's port opens or closes, and reads that wait for replies."""

import asyncio
import os
from math import inf

import pytest

from bridge.effects import SendToBoard
from bridge.fc.session import FcSession
from service.daemon.daemon import Daemon
from service.daemon.fc_connection import STOPPED, FcPort, Traffic
from service.machine import event_loop
from service.settings import Settings
from service.settings.addresses import SimulatedFc
from tests.support.inside import inside
from tests.support.programs import TIMEOUT_S, until_async


def is_found(daemon: Daemon) -> bool:
    return inside(daemon.bridge).session.state.controller is not None


@pytest.mark.parametrize("event", ["opened", "closed"])
async def test_the_flight_controller_is_found_again(event: str, monkeypatch: pytest.MonkeyPatch) -> None:
    faults = 0
    as_written = getattr(FcSession, event)

    def wrong_once(session: FcSession, now: float, *why: str | None) -> None:
        nonlocal faults
        faults += 1
        if faults == 1:
            raise AssertionError("a bug")
        as_written(session, now, *why)

    monkeypatch.setattr(FcSession, event, wrong_once)
    monkeypatch.setattr("service.daemon.fc_connection._RESTART_S", 0)
    daemon = Daemon(Settings(SimulatedFc()))
    running = asyncio.create_task(daemon.run())
    await until_async(lambda: faults or is_found(daemon), "the first opening")
    if event == "closed":
        asyncio.get_running_loop().call_soon(daemon.fc._port.move_on)
    await until_async(lambda: faults and is_found(daemon), "the flight controller")
    assert not running.done()
    running.cancel()
    await asyncio.wait([running])


async def test_a_bug_does_not_prevent_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(_session: FcSession, _now: float, _why: str | None) -> None:
        raise AssertionError("a bug")

    monkeypatch.setattr(FcSession, "closed", wrong)
    daemon = Daemon(Settings(SimulatedFc()))
    running = asyncio.create_task(daemon.run())
    await until_async(lambda: is_found(daemon), "the flight controller")
    running.cancel()
    await asyncio.wait([running], timeout=TIMEOUT_S)
    assert running.done()


async def test_the_port_is_held_until_the_replies_to_polls_can_have_arrived() -> None:
    daemon = Daemon(Settings(SimulatedFc()))
    running = asyncio.create_task(daemon.run())
    await until_async(lambda: is_found(daemon), "the flight controller")
    loop = event_loop.running()
    complete_at = loop.time() + 3600
    daemon.fc.carry_out(SendToBoard([], None, may_gather=False, asks=True, complete_at=complete_at))
    assert loop.lane.held_until == complete_at
    daemon.fc.carry_out(SendToBoard([], None, may_gather=False, asks=True, complete_at=-inf))
    assert loop.lane.held_until == -inf
    # Pass-through gathers by itself.
    daemon.fc._port.hold(complete_at)
    daemon.fc.carry_out(SendToBoard([], None, may_gather=True, asks=False, complete_at=-inf))
    assert loop.lane.held_until == complete_at
    running.cancel()
    await asyncio.wait([running])


class Unclosable:
    """A device whose close fails."""

    def __init__(self) -> None:
        self._ends = os.pipe()

    def fileno(self) -> int:
        return self._ends[0]

    def close(self) -> None:
        for end in self._ends:
            os.close(end)
        raise OSError("failed")


async def test_a_port_that_fails_to_close_is_reported_as_closed() -> None:
    async def open_device() -> Unclosable:
        return Unclosable()

    opened = asyncio.Event()
    closed: list[str] = []
    port = FcPort(open_device, opened.set, lambda _data, _now: None, closed.append, Traffic())
    running = asyncio.create_task(port.run())
    await opened.wait()
    running.cancel()
    await asyncio.wait([running])
    assert running.cancelled()
    assert closed == [STOPPED]
