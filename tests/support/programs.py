# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon and the simulated Naze as processes, as started by a user."""

import asyncio
import itertools
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from service.daemon.client import ControlError, ask_daemon
from tests.support.forked import Forked
from tests.support.plan import PlanRow, as_items

#: The general timeout, s, for anything that a test waits for.
TIMEOUT_S = 50.0
REPOSITORY = Path(__file__).resolve().parents[2]
NAZE_BRIDGE = [sys.executable, "-c", "from service.cli.program import start; start()"]
T = TypeVar("T")


def until(condition: Callable[[], T | None], what: str) -> T:
    """Wait for a true value and return it."""
    found = happens(condition)
    assert found, f"timed out waiting for {what}"
    return found


def happens(condition: Callable[[], T | None], seconds: float = TIMEOUT_S) -> T | None:
    """Wait for a true value; return the last value after a timeout."""
    deadline = time.monotonic() + seconds
    pause_s = 0.02
    while True:
        found = condition()
        if found or time.monotonic() >= deadline:
            return found
        time.sleep(pause_s)
        # A condition may be a script in a browser or a whole log: asked often, it costs more than what it waits for.
        pause_s = min(pause_s * 1.2, 0.1)


async def until_async(condition: Callable[[], T | None], what: str) -> T:
    deadline = time.monotonic() + TIMEOUT_S
    while not (found := condition()):
        assert time.monotonic() < deadline, f"timed out waiting for {what}"
        await asyncio.sleep(0.01)
    return found


#: Above all default ports, and below 32768, where the kernel's own choices begin: one of those could take a port
#: before the program under test does. Each worker has its own for a whole run: a program that another test has left, or
#: that sends where no one listens, is not heard here.
_FIRST_PORT, _PORTS, _PORTS_OF_A_WORKER = 20_000, 12_000, 1_500
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_ports = itertools.count(_WORKER * _PORTS_OF_A_WORKER + os.getpid() % 500)


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM, host: str = "127.0.0.1") -> int:
    for number in _ports:
        port = _FIRST_PORT + number % _PORTS
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, kind) as probe, suppress(OSError):
            probe.bind((host, port))
            return port
    raise AssertionError("unreachable: the ports never end")


def run_naze_bridge(*arguments: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a subcommand to its end; with `options` (of subprocess.run), in a new interpreter."""
    words = list(map(str, arguments))
    ended: subprocess.CompletedProcess[str]
    if options:
        usual: dict[str, Any] = {"cwd": REPOSITORY, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        ended = subprocess.run([*NAZE_BRIDGE, *words], timeout=TIMEOUT_S, check=False, **usual | options)
        return ended
    with TemporaryDirectory() as folder:
        output, error = Path(folder, "output"), Path(folder, "error")
        process = Forked(words, REPOSITORY, output, error)
        try:
            code = process.wait(TIMEOUT_S)
        finally:
            process.kill()
        return subprocess.CompletedProcess(words, code, output.read_text(), error.read_text())


class Program:
    """A `naze-bridge` that runs until it is ended; its output goes to a file."""

    def __init__(self, output: Path, *arguments: str) -> None:
        self._output = output
        self._arguments = arguments
        output.touch()
        self.process = self._start()

    def _start(self) -> Forked | subprocess.Popen[bytes]:
        return Forked(self._arguments, REPOSITORY, self._output, self._output)

    @property
    def printed(self) -> str:
        return self._output.read_text()

    @property
    def is_alive(self) -> bool:
        return self.process.poll() is None

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Send a signal and return the exit status."""
        if self.is_alive:
            self.process.send_signal(number)
        try:
            return self.process.wait(TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise


def control(address: Path, line: str) -> str:
    """Send a line to a simulated board's control socket; return the reply."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(str(address))
        connection.sendall(f"{line}\n".encode())
        with connection.makefile() as answers:
            return answers.readline().strip()


class Board(Program):
    """`naze-bridge sim`. `line` sends commands to its control socket (simulator/links/control.py).

    `fc` is the value for a daemon's --fc: a socket with `tcp`, else a pseudo-terminal.
    """

    def __init__(self, directory: Path, *options: str, tcp: bool = False) -> None:
        self.link = directory / "naze"
        address = f"127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        self.fc = f"tcp:{address}" if tcp else str(self.link)
        self._control = directory / "naze.sock"
        place = ("--tcp", address) if tcp else ("--link", str(self.link))
        # A boot takes 7 s, which no test here needs.
        super().__init__(
            directory / "board.log", "sim", *place, "--boot", "2000", "--control", str(self._control), *options
        )

    def wait(self) -> None:
        until(lambda: "Simulated " in self.printed or not self.is_alive, "the simulated board")
        assert self.is_alive, self.printed

    def line(self, line: str) -> str:
        return control(self._control, line)

    def set(self, line: str) -> None:
        answer = self.line(line)
        assert answer == "ok", answer

    def stats(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.line("stats"))
        return found

    def records(self) -> list[str]:
        """The stored list, each record in hex."""
        records: list[str] = self.stats()["records"]
        return records

    def assert_unharmed(self) -> None:
        """Assert that nothing sent to the board would have harmed a real one."""
        stats = self.stats()
        assert stats["hazard_runs"] == stats["rx_overflows"] == stats["tx_overflows"] == 0, stats
        assert stats["max_outstanding_reply_bytes"] <= 255, stats
        assert not stats["cli_entered"]


class Daemon(Program):
    """`naze-bridge run`. Without `gcs` it listens for UDP on a free port, `port`. config: the text of its file."""

    def __init__(
        self,
        directory: Path,
        fc: str,
        gcs: Sequence[str] = (),
        state_dir: Path | None = None,
        options: Sequence[str] = (),
        config: str = "",
    ) -> None:
        self.port = 0 if gcs else free_port()
        self.state_dir = state_dir or directory / "state"
        links = [word for link in gcs or (f"udpin:127.0.0.1:{self.port}",) for word in ("--gcs", link)]
        files = ["--state-dir", str(self.state_dir)]
        if config:
            (directory / "config.toml").write_text(config)
            files += ["--config", str(directory / "config.toml")]
        super().__init__(directory / "daemon.log", "run", "--fc", fc, *links, *files, *options)

    @property
    def address(self) -> tuple[str, int]:
        return "127.0.0.1", self.port

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        return ask_daemon(self.state_dir, request)

    def status(self) -> dict[str, Any] | None:
        """The status; None if the daemon does not answer (yet)."""
        try:
            return self.ask({"do": "status"})
        except (ControlError, OSError):
            return None

    def ground_stations(self) -> list[str]:
        """The connected ground stations, as in the status."""
        stations: list[str] = self.ask({"do": "status"})["ground_stations"]
        return stations

    def wait(self, state: str = "MSP") -> None:
        """Wait until the flight controller is found, and over MSP until its first status is here."""

        def arrived() -> bool:
            assert self.is_alive, self.printed
            status = self.status()
            if status is None or status["state"] != state:
                return False
            return state != "MSP" or status["armed"] is not None

        until(arrived, f"a daemon in state {state}")

    def wait_up(self) -> None:
        """Wait until the daemon runs, with or without a flight controller."""
        until(lambda: self.status() or not self.is_alive, "the daemon")
        assert self.is_alive, self.printed

    def missions(self) -> list[dict[str, Any]]:
        """The received missions, newest first."""
        missions: list[dict[str, Any]] = self.ask({"do": "missions", "limit": 100})["missions"]
        return missions

    def pull(self) -> dict[str, Any]:
        """The flight controller's mission, read by the daemon."""
        return self.ask({"do": "pull"})

    def push(self, plan: Sequence[PlanRow]) -> None:
        """Write a list to the board like `naze-bridge push`."""
        answer = self._push(plan)
        assert answer["ack"] == "MAV_MISSION_ACCEPTED", answer

    def try_clear(self) -> bool:
        """Clear the board; False if the daemon refused because a transfer is running."""
        if self._push([])["ack"] == "MAV_MISSION_ACCEPTED":
            return True
        time.sleep(1.0)  # the log leaves out events that repeat more than 20 times in 10 s, for which tests wait
        return False

    def _push(self, plan: Sequence[PlanRow]) -> dict[str, Any]:
        items = [asdict(item) for item in as_items(plan)]
        return self.ask({"do": "push", "source": "test", "items": items})

    def kill_and_restart(self) -> None:
        """Kill the daemon, as in a power cut, and start it again."""
        self.process.kill()
        self.process.wait()
        self.process = self._start()

    def events(self) -> list[dict[str, Any]]:
        whole, _, _ = self.printed.rpartition("\n")  # the last line may be half written
        return [json.loads(line) for line in whole.splitlines() if line.startswith("{")]

    def has_logged(self, event: str) -> dict[str, Any] | None:
        """The last event of that name, None without one."""
        found = [entry for entry in self.events() if entry["event"] == event]
        return found[-1] if found else None
