# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --kind`: other flight controllers on a pseudo-terminal and on a socket, as processes."""

import json
import signal
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from protocols.msp.frame import request
from protocols.msp.nav import NavAction
from simulator.board.nav_waypoint import FLAG_LAST
from tests.support.msp_bench import Frame, split_frames, waypoint
from tests.support.programs import NAZE_BRIDGE, REPOSITORY, TIMEOUT_S, control, free_port, run_naze_bridge, until


class Simulator:
    """A simulator process, on a socket at `port` unless it has a link."""

    def __init__(self, directory: Path, *options: str, link: Path | None = None) -> None:
        self.port = free_port(socket.SOCK_STREAM)
        self._control = directory / "control"
        place = ("--link", str(link)) if link else ("--tcp", f"127.0.0.1:{self.port}")
        arguments = ["sim", *place, "--control", str(self._control), *options]
        self.process = subprocess.Popen([*NAZE_BRIDGE, *arguments], cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout
        self.greeting = self.process.stdout.readline()

    def line(self, line: str) -> str:
        return control(self._control, line)

    def client(self) -> "Client":
        return Client(self.port)

    def end(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(TIMEOUT_S)


class Client:
    """A TCP client that sends one request at a time."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), TIMEOUT_S)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def ask(self, command: int, payload: bytes = b"", timeout: float = TIMEOUT_S) -> Frame | None:
        """The reply; None after the timeout, ConnectionError if disconnected."""
        self.socket.sendall(request(command, payload))
        self.socket.settimeout(timeout)
        received = b""
        while not (frames := split_frames(received)):
            try:
                data = self.socket.recv(4096)
            except TimeoutError:
                return None
            if not data:
                raise ConnectionError
            received += data
        return frames[0]

    def payload(self, command: int, payload: bytes = b"") -> bytes:
        frame = self.ask(command, payload)
        assert frame is not None
        assert frame.direction == ">"
        return frame.payload


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Simulator]]:
    started: list[Simulator] = []

    def make(*options: str, link: Path | None = None) -> Simulator:
        started.append(Simulator(tmp_path, *options, link=link))
        return started[-1]

    yield make
    for simulator in started:
        simulator.process.kill()
        # Also closes its output.
        simulator.process.communicate()


def test_an_inav_runs_on_a_socket(start: Callable[..., Simulator]) -> None:
    simulator = start("--kind", "inav", "--inav-version", "8.0.1")
    assert simulator.greeting == f"Simulated INAV 8.0.1 at 127.0.0.1:{simulator.port}. Ctrl-C ends it.\n"
    with simulator.client() as client:
        assert client.payload(3) == bytes((8, 0, 1))
    assert simulator.end() == 0


def test_a_multiwii_runs_on_a_pseudo_terminal(start: Callable[..., Simulator], tmp_path: Path) -> None:
    simulator = start("--kind", "multiwii", "--baud", "57600", link=tmp_path / "tty")
    assert simulator.greeting == f"Simulated MultiWii at {tmp_path / 'tty'}, 57600 baud. Ctrl-C ends it.\n"
    with serial.Serial(str(tmp_path / "tty"), 57600, timeout=TIMEOUT_S) as port:
        port.write(request(100))
        assert port.read(13)[:6] == bytes((*b"$M>", 7, 100, 241))


def test_a_naze_runs_on_a_socket(start: Callable[..., Simulator]) -> None:
    with start().client() as client:
        assert client.payload(100)[0] == 211


def test_a_second_client_waits_for_the_turn(start: Callable[..., Simulator]) -> None:
    simulator = start("--kind", "inav")
    with simulator.client() as first, simulator.client() as second:
        assert first.payload(2) == b"INAV"
        assert second.ask(2, timeout=0.3) is None
        first.socket.close()
        # Now the first request is answered.
        assert second.payload(3) == b"INAV"


def test_after_a_crash_the_port_is_gone_until_a_power_cycle(start: Callable[..., Simulator]) -> None:
    simulator = start("--kind", "inav")
    with simulator.client() as client:
        client.payload(209, waypoint(1).pack(1))
        client.payload(209, waypoint(action=NavAction.JUMP, p1=0).pack(2))
        with pytest.raises(ConnectionError):
            client.ask(20)
    with pytest.raises(ConnectionRefusedError):
        simulator.client()
    assert json.loads(simulator.line("stats"))["power"] == "CRASHED"
    assert [simulator.line("power off"), simulator.line("power on")] == ["ok", "ok"]
    # During boot nothing is received.
    with simulator.client() as client:
        assert until(lambda: client.ask(20, timeout=0.5), "an answer") == (">", 20, bytes((0, 120, 0, 0)))


def test_the_eeprom_is_kept_in_a_file(start: Callable[..., Simulator], tmp_path: Path) -> None:
    state = tmp_path / "eeprom"
    simulator = start("--kind", "inav", "--state", str(state))
    with simulator.client() as client:
        client.payload(209, waypoint(1, flag=FLAG_LAST).pack(1))
        client.payload(19, b"\0")
    assert json.loads(simulator.line("stats"))["records"] == [waypoint(1, flag=FLAG_LAST).pack(1).hex()]
    simulator.end()
    with start("--kind", "inav", "--state", str(state)).client() as client:
        client.payload(18, b"\0")
        assert client.payload(20) == bytes((0, 120, 1, 1))


def test_truth_reports_the_flight(start: Callable[..., Simulator]) -> None:
    simulator = start("--kind", "inav")
    assert simulator.line("armed 1") == "ok"
    until(lambda: json.loads(simulator.line("truth"))["flight"]["height_m"] > 0.1, "the take-off")
    assert json.loads(simulator.line("truth"))["armed"] is True


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--kind", "inav"), "--link PATH or --tcp HOST:PORT"),
        (("--tcp", "5760"), "'5760' is not HOST:PORT"),
        (("--kind", "inav", "--tcp", "127.0.0.1:1", "--tele-prot", "1"), "--tele-prot has no effect with --kind inav"),
        (("--tcp", "127.0.0.1:1", "--speed", "4"), "--speed has no effect with a board that does not fly"),
        (("--kind", "inav", "--tcp", "192.0.2.1:5760"), "192.0.2.1:5760 cannot be opened for listening"),
        (("--kind", "inav", "--tcp", "127.0.0.1:5760", "--state", "pyproject.toml"), "name another file"),
    ],
)
def test_an_invalid_option_is_reported_in_one_sentence(options: tuple[str, ...], says: str) -> None:
    ended = run_naze_bridge("sim", *options)
    assert ended.returncode != 0
    assert says in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_port_in_use_is_named_with_the_remedy(start: Callable[..., Simulator]) -> None:
    first = start("--kind", "inav")
    second = run_naze_bridge("sim", "--kind", "inav", "--tcp", f"127.0.0.1:{first.port}")
    why = f"127.0.0.1:{first.port} cannot be opened for listening: Address already in use; give another port"
    assert (second.returncode, second.stderr) == (1, f"naze-bridge: {why}\n")
