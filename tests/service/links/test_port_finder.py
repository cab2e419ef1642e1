# SPDX-License-Identifier: GPL-3.0-or-later
"""`fc = "auto"`: finding the flight controller among radios and ports in use, on pseudo-terminals."""

import asyncio
import json
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon
from service.links.fc_device import PortError
from service.links.port_finder import PORTS_FILE, PortFinder
from service.settings import Settings
from service.settings.addresses import AutoFc
from simulator.links.pty_link import PtyLink
from simulator.naze.board import SimulatedNaze
from tests.support.inside import inside
from tests.support.pi_with_ports import Pi
from tests.support.programs import until_async


@asynccontextmanager
async def running(pi: Pi, state_dir: Path) -> AsyncIterator[tuple[Daemon, DaemonApi]]:
    daemon = Daemon(Settings(AutoFc(), state_dir=state_dir), pi)
    task = asyncio.create_task(daemon.run())
    try:
        yield daemon, DaemonApi(daemon)
    finally:
        task.cancel()
        await asyncio.wait([task])


def plug_naze(pi: Pi, name: str) -> PtyLink:
    board = SimulatedNaze()
    board.power_on(asyncio.get_running_loop().time() - 60)
    link = PtyLink(board, pi.path(f"/dev/{name}"), asyncio.get_running_loop())
    link.plug()
    return link


async def test_the_port_of_a_radio_is_not_searched(pi: Pi) -> None:
    pi.usb("ttyUSB0", "1-1")
    pi.terminal("ttyUSB0")
    finder = PortFinder(pi, None, ["/dev/ttyUSB0"])
    with pytest.raises(PortError, match="there is no serial port"):
        await finder.open()


async def test_the_flight_controllers_port_is_remembered(
    pi: Pi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.links.port_finder._SEARCH_S", 1.0)
    pi.usb("ttyUSB0", "1-1")
    pi.usb("ttyUSB1", "1-2")
    pi.terminal("ttyUSB0")
    naze = plug_naze(pi, "ttyUSB1")
    state = tmp_path / "state"
    state.mkdir()
    async with running(pi, state) as (daemon, jobs):
        await until_async(lambda: inside(daemon.bridge).session.state.controller, "the flight controller")
        assert jobs.status()["port"] == "/dev/ttyUSB1"
        await until_async((state / "ports.json").exists, "the memory")
    assert pi.sent_to("ttyUSB0")
    assert json.loads((state / "ports.json").read_text()) == {"flight_controller": "usb 1-2 10c4:ea60"}
    async with running(pi, state) as (daemon, jobs):
        await until_async(lambda: inside(daemon.bridge).session.state.controller, "the flight controller")
        assert jobs.status()["ports_passed_over"] == []
        assert pi.sent_to("ttyUSB0") == b""
    naze.unplug()


async def test_a_silent_port_is_skipped(pi: Pi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.links.port_finder._SEARCH_S", 1.0)
    pi.terminal("ttyAMA0")
    pi.usb("ttyACM0", "1-1.4", ("0483", "5740", "STMicroelectronics", "STM32 Virtual ComPort"))
    plug_naze(pi, "ttyACM0")
    async with running(pi, tmp_path) as (daemon, jobs):
        await until_async(lambda: inside(daemon.bridge).session.state.controller, "the flight controller")
        assert jobs.status()["port"] == "/dev/ttyACM0"
        assert jobs.status()["ports_passed_over"] == ["/dev/ttyAMA0: no flight controller answers"]
        # Only complete identification requests were sent.
        frames = re.findall(rb"\$M<\x00(?:dd|\x02\x02)", sent := pi.sent_to("ttyAMA0"))
        assert frames
        assert b"".join(frames) == sent


async def test_a_port_used_by_another_program_is_not_opened(pi: Pi, tmp_path: Path) -> None:
    pi.terminal("ttyAMA0")
    pi.usb("ttyUSB0", "1-1")
    pi.terminal("ttyUSB0")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to("ttyAMA0")
    pi.runs(77, "/usr/sbin/gpsd", "-n", "/dev/serial0")
    pi.runs(78, "/usr/bin/mavproxy.py", "--master=/dev/ttyUSB0,57600")
    async with running(pi, tmp_path) as (daemon, jobs):
        await until_async(lambda: daemon.fc.trouble, "the reason")
        assert "gpsd (pid 77) uses it" in daemon.fc.trouble
        assert "mavproxy.py (pid 78) uses it" in daemon.fc.trouble
        assert jobs.status()["port"] is None


async def test_a_board_that_need_not_answer_is_on_the_last_or_only_port(pi: Pi, tmp_path: Path) -> None:
    finder = PortFinder(pi, None)
    with pytest.raises(PortError, match="none was found"):
        finder.port_of_silent_board()
    pi.usb("ttyUSB0", "1-1")
    pi.terminal("ttyUSB0")
    assert finder.port_of_silent_board() == "/dev/ttyUSB0"
    pi.usb("ttyUSB1", "1-2")
    pi.terminal("ttyUSB1")
    with pytest.raises(PortError, match="one of /dev/ttyUSB0, /dev/ttyUSB1"):
        finder.port_of_silent_board()
    (tmp_path / PORTS_FILE).write_text('{"flight_controller": "usb 1-2 10c4:ea60"}')
    assert PortFinder(pi, tmp_path).port_of_silent_board() == "/dev/ttyUSB1"
