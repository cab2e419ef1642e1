# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated Naze on real descriptors: a socket pair, and a pty in a separate process."""

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner

from protocols.mission_item import identify, pack_records
from protocols.msp.frame import MspFrame, MspParser, request
from protocols.msp.mission import INFO_REQUEST, decode_info, encode_begin, encode_chunk, encode_commit
from simulator.commands.sim import sim
from simulator.links.pipe_link import SimLink
from simulator.naze.board import SimulatedNaze
from tests.support.naze_bench import mission
from tests.support.programs import TIMEOUT_S, control, until

IDENT = request(100)
#: After this much silence no answer is expected.
SILENCE_S = 1.0


async def ask_socket(far: socket.socket, frame: bytes) -> MspFrame:
    loop, parser = asyncio.get_running_loop(), MspParser()
    await loop.sock_sendall(far, frame)
    async with asyncio.timeout(TIMEOUT_S):
        while True:
            if frames := parser.feed(await loop.sock_recv(far, 4096)):
                return frames[0]


async def test_the_pipe_answers_at_once_and_the_board_survives_unplugging() -> None:
    link = SimLink(SimulatedNaze(), asyncio.get_running_loop())
    with await link.start() as far:
        assert (await ask_socket(far, IDENT)).payload[0] == 211
        await ask_socket(far, encode_begin(identify(mission(3))))
        link.stop()
        assert await asyncio.get_running_loop().sock_recv(far, 10) == b""
    with await link.start() as far:
        info = decode_info((await ask_socket(far, INFO_REQUEST)).payload)
        assert info is not None
        assert info.flags.name == "TRANSFER_OPEN"
        link.stop()


@pytest.mark.parametrize("turns", [0, 3])
async def test_a_client_can_reconnect(turns: int) -> None:
    link = SimLink(SimulatedNaze(), asyncio.get_running_loop())
    (await link.start()).close()
    for _ in range(turns):
        await asyncio.sleep(0)
    with await link.start() as far:
        assert (await ask_socket(far, IDENT)).payload[0] == 211
    link.stop()


class Simulator:
    """`naze-bridge sim` as a separate process."""

    def __init__(self, directory: Path, *options: str) -> None:
        self.link = directory / "naze"
        self._control = directory / "control"
        program = "from simulator.commands.sim import sim; sim()"
        arguments = ["--link", str(self.link), "--control", str(self._control), *options]
        self.process = subprocess.Popen([sys.executable, "-c", program, *arguments], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.greeting = self.process.stdout.readline()

    def control(self, line: str) -> str:
        return control(self._control, line)

    def stats(self) -> dict[str, object]:
        found: dict[str, object] = json.loads(self.control("stats"))
        return found

    def open(self, baud: int = 115200) -> serial.Serial:
        return serial.Serial(str(self.link), baud, timeout=0.05)

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        code = self.process.wait(TIMEOUT_S)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return code


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Simulator]]:
    started: list[Simulator] = []

    def make(*options: str) -> Simulator:
        started.append(Simulator(tmp_path, *options))
        return started[-1]

    yield make
    for simulator in started:
        simulator.end(signal.SIGKILL)  # also closes the pipe of one that has already ended


def ask(port: serial.Serial, frame: bytes, seconds: float = TIMEOUT_S) -> MspFrame | None:
    """Ask once; None after this many seconds of real time."""
    parser, deadline = MspParser(), time.monotonic() + seconds
    port.write(frame)
    while time.monotonic() < deadline:
        if frames := parser.feed(port.read(4096)):
            return frames[0]
    return None


def test_the_port_answers_at_the_boards_speed_only(start: Callable[..., Simulator]) -> None:
    simulator = start("--baud", "57600")
    assert simulator.greeting == f"Simulated Naze at {simulator.link}, 57600 baud. Ctrl-C ends it.\n"
    with simulator.open(57600) as port:
        assert ask(port, IDENT) is not None
        port.baudrate = 115200
        assert ask(port, IDENT, SILENCE_S) is None
        port.baudrate = 57600
        # Bytes received at the wrong speed may have begun a frame; the receiver drops it after a while.
        until(lambda: ask(port, IDENT, SILENCE_S), "an answer")


def test_the_speed_changes_with_arming(start: Callable[..., Simulator]) -> None:
    simulator = start("--tele-prot", "3")
    with simulator.open() as port:
        assert ask(port, IDENT) is not None
        assert simulator.control("armed 1") == "ok"
        until(lambda: simulator.stats()["baud"] == 57600, "the speed of an armed board")
        port.baudrate = 57600
        port.reset_input_buffer()
        until(lambda: b"\xfe\x1c" in port.read(200), "an attitude")


def test_unplugging_removes_the_port_and_plugging_restores_it(start: Callable[..., Simulator]) -> None:
    simulator = start()
    port = simulator.open()
    assert ask(port, IDENT) is not None
    assert simulator.control("unplug") == "ok"
    assert not os.path.lexists(simulator.link)
    with pytest.raises(serial.SerialException):
        until(lambda: ask(port, IDENT, SILENCE_S) is None and False, "the end of the port")
    port.close()
    assert simulator.control("plug") == "ok"
    with simulator.open() as again:
        assert ask(again, IDENT) is not None


def test_the_flash_survives_a_kill(start: Callable[..., Simulator], tmp_path: Path) -> None:
    state, records = str(tmp_path / "flash"), mission(20)
    simulator = start("--state", state, "--flash-stall", "5")
    with simulator.open() as port:
        assert ask(port, encode_begin(identify(records))) is not None
        first = 0
        while first < len(records):
            chunk = encode_chunk(pack_records(records), first, 15)
            assert ask(port, chunk.frame) is not None
            first += chunk.count
        assert ask(port, encode_commit(identify(records))) is not None
    assert simulator.end(signal.SIGKILL) == -signal.SIGKILL
    assert start("--state", state).stats()["records"] == [record.pack().hex() for record in records]


def test_control_switches_faults_and_power(start: Callable[..., Simulator]) -> None:
    simulator = start()
    with simulator.open() as port:
        assert simulator.control("hang 1") == "ok"
        assert ask(port, IDENT, SILENCE_S) is None
        assert simulator.control("hang 0") == "ok"
        assert ask(port, IDENT) is not None
        assert simulator.control("power off") == "ok"
        assert ask(port, IDENT, SILENCE_S) is None
        assert simulator.stats()["power"] == "OFF"
    assert simulator.control("bit_error_rate much") == "error: bit_error_rate takes a number, not 'much'"
    assert simulator.control("boxes inf") == "error: boxes takes a number, not 'inf'"
    assert simulator.control("sing") == "error: unknown line 'sing'"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly(start: Callable[..., Simulator], tmp_path: Path, number: signal.Signals) -> None:
    simulator = start()
    assert simulator.end(number) == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--link", "{}/none/naze"], "Error: {}/none/naze cannot be created: No such file or directory\n"),
        (["--link", "{}/file"], "Error: {}/file already exists: use another --link, or remove it\n"),
        (["--link", "{}/link"], "Error: {}/link already exists: use another --link, or remove it\n"),
        (["--link", "{}/naze", "--control", "{}/none/socket"], "Error: {}/none/socket cannot be created: "),
        (["--link", "{}/naze", "--state", "{}/none/flash"], "Error: the state file {}/none/flash cannot be used: "),
        (["--link", "{}/naze", "--state", "{}/file"], "Error: the state file {}/file has 4 bytes, but this board's"),
    ],
)
def test_obstacles_at_start_are_reported(tmp_path: Path, options: list[str], complaint: str) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("file")
    done = CliRunner().invoke(sim, [option.format(tmp_path) for option in options])
    assert done.exit_code == 1
    assert done.stderr.startswith(complaint.format(tmp_path))
    assert (tmp_path / "link").readlink() == Path("file")
    assert (tmp_path / "file").read_text() == "mine"


def test_the_link_of_a_killed_simulator_is_replaced(start: Callable[..., Simulator]) -> None:
    killed = start()
    killed.end(signal.SIGKILL)
    assert os.path.islink(killed.link)
    with start().open() as port:
        assert ask(port, IDENT) is not None


def test_a_link_older_than_the_terminal_behind_it_is_replaced(start: Callable[..., Simulator]) -> None:
    other = start()
    stale = other.link.with_name("stale")
    # The kernel gave the number of a killed simulator's terminal to this one.
    stale.symlink_to(other.link.readlink())
    os.utime(stale, (0, 0), follow_symlinks=False)
    start("--link", str(stale), "--control", f"{stale}-control")
    with serial.Serial(str(stale), 115200, timeout=0.05) as port:
        assert ask(port, IDENT) is not None
    assert stale.readlink() != other.link.readlink()


def test_a_link_taken_over_by_another_simulator_is_not_removed(start: Callable[..., Simulator]) -> None:
    first = start()
    first.link.unlink()
    second = start()
    second_terminal = second.link.readlink()
    assert first.end() == 0
    assert second.link.readlink() == second_terminal


def test_the_link_of_a_running_simulator_is_not_replaced(start: Callable[..., Simulator], tmp_path: Path) -> None:
    first = start()
    with serial.Serial(str(first.link), 115200, timeout=0.05, exclusive=True) as port:
        program = "from simulator.commands.sim import sim; sim()"
        second = subprocess.run(
            [sys.executable, "-c", program, "--link", str(first.link)],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
        )
        assert second.returncode == 1
        assert f"{first.link} belongs to a running simulator" in second.stderr
        assert "Traceback" not in second.stderr
        # Checking the lock does not release it.
        again = subprocess.run([sys.executable, "-c", program, "--link", str(first.link)], timeout=TIMEOUT_S)
        assert again.returncode == 1
        assert ask(port, IDENT) is not None
