# SPDX-License-Identifier: GPL-3.0-or-later
"""A command's own bridge (`--fc`), for one request."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from payloads.mission_data import Json
from service.daemon.api import DaemonApi
from service.daemon.client import FIRMWARE_REQUESTS, STATUS, ControlError, Interrupted
from service.daemon.daemon import Daemon
from service.machine.log_setup import set_up_logging
from service.settings import Settings, takeoff_limit_m
from service.settings.addresses import AutoFc, FcAddress, TcpFc, UdpFc

#: An unknown speed is found within 8 s.
_SEARCH_TIMEOUT_S = 12.0
#: With `auto`: the header and two on USB.
_PORTS_SEARCHED = 3
#: A round of telemetry takes a second; at 9600 baud two.
_TELEMETRY_TIMEOUT_S = 3.0
#: A board that is found by its MAVLink telemetry counts as armed until the heartbeat says otherwise.
_HEARTBEAT_TIMEOUT_S = 1.5
_INTERVAL_S = 0.05
_UNCONFIRMED = "interrupted; the flight controller has not confirmed that it kept its mission: see `naze-bridge pull`"
_SHOWN = ("armed", "battery_v", "satellites", "mission_records")
_FORBID_FLASHING = ("armed", "battery_v")


async def ask_directly(
    fc: FcAddress,
    request: Json,
    progress: Callable[[Any], None] = lambda _: None,
    *,
    state_dir: Path | None = None,
    even_silent: bool = False,
) -> Json:
    """Send a request to our own bridge on this port. ControlError or StoreError if there is no reply.

    `state_dir`: for backups of firmware. `even_silent`: a port without a flight controller is not an error. The status
    has the number of bytes received.

    If cancelled, a push is aborted, and Interrupted says how it ended.
    """
    set_up_logging("error")
    daemon = Daemon(Settings(fc, takeoff_max_m=takeoff_limit_m()))
    api = DaemonApi(daemon, state_dir)
    running = asyncio.create_task(daemon.run())
    job: asyncio.Future[Json] | None = None
    try:
        timeout_s = _SEARCH_TIMEOUT_S * (_PORTS_SEARCHED if isinstance(fc, AutoFc) else 1)
        await _wait(lambda: bool(daemon.fc.trouble) or daemon.fc.found_at is not None, timeout_s)
        if daemon.fc.trouble:
            raise ControlError(daemon.fc.trouble)
        if daemon.fc.found_at is None and request["do"] not in FIRMWARE_REQUESTS:
            where = daemon.fc.where
            if even_silent:
                return api.status()
            what = "the Wi-Fi adapter" if isinstance(fc, TcpFc | UdpFc) else "the wiring and the speed"
            raise ControlError(f"no flight controller answers on {where}: check its power and {what}")
        # The controller is identified before the telemetry arrives, and some never send all of it.
        if request == STATUS:
            await _wait(lambda: None not in map(api.status().get, _SHOWN), _TELEMETRY_TIMEOUT_S)
        elif request["do"] in FIRMWARE_REQUESTS:
            if daemon.fc.found_at is not None:
                await _wait(lambda: None not in map(api.status().get, _FORBID_FLASHING), _TELEMETRY_TIMEOUT_S)
        else:
            await _wait(lambda: api.status()["armed"] is not True, _HEARTBEAT_TIMEOUT_S)
        job = asyncio.ensure_future(api.do(request, lambda answer: progress(answer["progress"])))
        return await asyncio.shield(job)
    except asyncio.CancelledError:
        if request["do"] != "push":
            raise
        if job is None:
            raise Interrupted("interrupted; nothing was written") from None
        await daemon.abort()
        raise Interrupted(f"interrupted: {job.result()['text']}" if job.done() else _UNCONFIRMED) from None
    finally:
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running


async def _wait(condition: Callable[[], bool], seconds: float) -> None:
    for _ in range(int(seconds / _INTERVAL_S)):
        if condition():
            return
        await asyncio.sleep(_INTERVAL_S)
