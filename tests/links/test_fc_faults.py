# SPDX-License-Identifier: GPL-3.0-or-later
"""An error of the bridge itself while the flight controller's port opens or closes."""

import asyncio

import pytest

from bridge.fc.session import FcSession
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import SimulatedFc
from tests.support.programs import until_async


def is_found(daemon: Daemon) -> bool:
    return daemon.bridge.session.state.controller is not None


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
