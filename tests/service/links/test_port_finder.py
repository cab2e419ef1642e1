# SPDX-License-Identifier: GPL-3.0-or-later
"""`fc = "auto"`: finding the flight controller among GPS receivers, radios and ports in use, on pseudo-terminals."""

import asyncio
import json
import os
import re
import tty
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from service.daemon.api import DaemonApi
from service.daemon.daemon import Daemon
from service.links.serial_ports import USB_CHIPS, serial_ports
from service.settings import Settings
from service.settings.addresses import AutoFc
from simulator.links.pty_link import PtyLink
from simulator.naze.board import SimulatedNaze
from tests.support.faulty_machine import FaultyMachine
from tests.support.programs import until_async

NMEA = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
CP2102 = ("10c4", "ea60", "Silicon Labs", "CP2102 USB to UART Bridge Controller")


class Pi(FaultyMachine):
    """A Raspberry Pi whose serial ports are pseudo-terminals."""

    def __init__(self, root: Path) -> None:
        super().__init__(root)
        self.path("/dev/ttyAMA0").unlink()
        self.wires: dict[str, int] = {}

    def usb(self, name: str, socket: str, chip: tuple[str, str, str, str] = CP2102) -> None:
        """Plug a USB serial chip in, without a terminal."""
        device = f"/sys/devices/usb1/{socket}"
        for fact, text in zip(("idVendor", "idProduct", "manufacturer", "product"), chip, strict=True):
            self.write(f"{device}/{fact}", f"{text}\n")
        self.path(f"{device}/{socket}:1.0/{name}").mkdir(parents=True)
        self.path(f"/sys/class/tty/{name}").mkdir(parents=True)
        self.path(f"/sys/class/tty/{name}/device").symlink_to(self.path(f"{device}/{socket}:1.0/{name}"))

    def terminal(self, name: str) -> None:
        """Give a port a terminal; its other end is in `wires`."""
        wire, terminal = os.openpty()
        tty.setraw(terminal)
        os.set_blocking(wire, False)
        self.wires[name] = wire
        self.path(f"/dev/{name}").symlink_to(os.ttyname(terminal))

    def sent_to(self, name: str) -> bytes:
        with suppress(BlockingIOError):
            return os.read(self.wires[name], 4096)
        return b""


@pytest.fixture
def pi(tmp_path: Path) -> Pi:
    return Pi(tmp_path / "root")


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


async def test_the_flight_controller_is_found_after_a_gps_receiver(pi: Pi, tmp_path: Path) -> None:
    pi.usb("ttyUSB0", "1-1")
    pi.usb("ttyUSB1", "1-2")
    pi.terminal("ttyUSB0")
    naze = plug_naze(pi, "ttyUSB1")
    state = tmp_path / "state"
    state.mkdir()

    async def gps() -> None:
        while True:
            os.write(pi.wires["ttyUSB0"], NMEA)
            await asyncio.sleep(0.2)

    talking = asyncio.create_task(gps())
    async with running(pi, state) as (daemon, jobs):
        await until_async(lambda: daemon.bridge.session.state.controller, "the flight controller")
        status = jobs.status()
        assert status["port"] == "/dev/ttyUSB1"
        assert status["ports_passed_over"] == ["/dev/ttyUSB0: a GPS receiver (NMEA) was heard there"]
        assert pi.sent_to("ttyUSB0") == b""
        await until_async((state / "ports.json").exists, "the memory")
    talking.cancel()
    kept = json.loads((state / "ports.json").read_text())
    assert kept["flight_controller"] == "usb 1-2 10c4:ea60"
    # After a restart its port is tried first, and a GPS receiver is remembered even while silent.
    async with running(pi, state) as (daemon, jobs):
        await until_async(lambda: daemon.bridge.session.state.controller, "the flight controller")
        assert jobs.status()["ports_passed_over"] == []
        naze.unplug()
        await until_async(lambda: jobs.status()["ports_passed_over"], "the other port's turn")
        assert pi.sent_to("ttyUSB0") == b""


async def test_a_silent_port_is_skipped(pi: Pi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.links.port_finder._SEARCH_S", 1.0)
    pi.terminal("ttyAMA0")
    pi.usb("ttyACM0", "1-1.4", ("0483", "5740", "STMicroelectronics", "STM32 Virtual ComPort"))
    plug_naze(pi, "ttyACM0")
    async with running(pi, tmp_path) as (daemon, jobs):
        await until_async(lambda: daemon.bridge.session.state.controller, "the flight controller")
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


@pytest.mark.parametrize(
    ("model", "serial0", "header"),
    [
        ("Raspberry Pi 3 Model B Plus Rev 1.3", "ttyS0", "/dev/ttyS0"),
        ("Raspberry Pi 4 Model B Rev 1.4", "ttyS0", "/dev/ttyS0"),
        ("Raspberry Pi 5 Model B Rev 1.0", "ttyAMA10", "/dev/ttyAMA0"),
        ("Raspberry Pi Zero 2 W Rev 1.0", "ttyAMA0", "/dev/ttyAMA0"),
    ],
)
def test_the_headers_uart_depends_on_the_model(pi: Pi, model: str, serial0: str, header: str) -> None:
    pi.write("/proc/device-tree/model", f"{model}\0")
    for name in ("ttyS0", "ttyAMA0", "ttyAMA10"):
        pi.write(f"/dev/{name}")
    pi.path("/dev/serial0").unlink()
    pi.path("/dev/serial0").symlink_to(serial0)
    assert [port.path for port in serial_ports(pi)] == [header]


@pytest.mark.parametrize(
    ("chip", "is_candidate"),
    [
        (CP2102, True),
        (("1a86", "7523", "1a86", "USB Serial"), True),
        (("1546", "01a7", "u-blox AG", "u-blox 7 - GPS/GNSS Receiver"), False),
        (("0403", "6001", "3D Robotics", "SiK Radio"), False),
        (("2341", "0043", "Arduino", "Uno"), False),
    ],
)
def test_only_known_usb_chips_are_searched(pi: Pi, chip: tuple[str, str, str, str], is_candidate: bool) -> None:
    pi.path("/dev/serial0").unlink()
    pi.usb("ttyUSB0", "1-1", chip)
    pi.write("/dev/ttyUSB0")
    assert [port.path for port in serial_ports(pi)] == ["/dev/ttyUSB0"] * is_candidate


def test_udev_knows_the_same_chips() -> None:
    rules = (Path(__file__).parents[3] / "systemd" / "60-naze-bridge.rules").read_text()
    named = re.findall(r'ATTRS{idVendor}=="(\w+)", ATTRS{idProduct}=="([\w|]+)"', rules)
    assert {(vendor, product) for vendor, products in named for product in products.split("|")} == set(USB_CHIPS)
