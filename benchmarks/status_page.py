# SPDX-License-Identifier: GPL-3.0-or-later
"""The cost of the status page: memory and CPU while it is not open, and push times under hostile browsers.

The daemon has everything switched on: page, zenoh, telemetry log. Then a list of 146 records is pushed repeatedly to a
simulated Naze at 115200 baud, first undisturbed, then while other programs request everything on the page from three
addresses, as fast as the limits permit. A push is one conversation with the flight controller: any delay of the loop
makes it longer.
"""

import select
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path

from benchmarks.figure import Figure, Floor
from benchmarks.idle import cpu_percents, listener, resident_mb, udpout
from benchmarks.missions import random_mission
from benchmarks.processes import ENVIRONMENT, ROOT, daemon, simulated_naze
from service.daemon.client import ask_daemon
from tests.support.programs import free_port

_PUSHES = 9
_ADDRESSES = ("127.0.0.1", "127.0.0.2", "127.0.0.3")
_PATHS = ("/api/missions/1", "/api/state", "/api/missions", "/metrics", "/page.js")
_PROMISED_MB = 75.0
_PROMISED_PERCENT = 3.0


def measure() -> list[Figure]:
    """Measure one daemon, idle and then under attack."""
    with tempfile.TemporaryDirectory() as directory, ExitStack() as stack:
        folder = Path(directory)
        board = stack.enter_context(simulated_naze(folder, "--baud", "115200"))
        port, zenoh_port = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
        config = folder / "config.toml"
        config.write_text(f'[web]\nlisten = "0.0.0.0:{port}"\n[zenoh]\nlisten = ["tcp/127.0.0.1:{zenoh_port}"]\n')
        ground = stack.enter_context(listener())
        bridge = stack.enter_context(daemon(folder, board.link, udpout(ground), "--config", str(config)))
        bridge.wait_for_event("fc.found")
        bridge.wait_for_event("web.listening")
        (percent,) = cpu_percents(bridge.pid)
        resident = resident_mb(bridge.pid)
        state_dir = folder / "state"
        quiet = _pushes_ms(state_dir)
        with _hostile_browsers(port, folder):
            pressed = _pushes_ms(state_dir)
        answered = sum(float(line) for line in (folder / "browsers.log").read_text().splitlines())
        after = resident_mb(bridge.pid)
    floor = Floor(statistics.median(quiet), "undisturbed")
    name = f"push of 146 records under {answered:.0f} answers/s"
    return [
        Figure("daemon with everything on, page not open: CPU of one core", percent, "%", None, _PROMISED_PERCENT),
        Figure("daemon with everything on: resident", resident, "MB", None, _PROMISED_MB),
        Figure("the same after hostile browsers", after, "MB", None, _PROMISED_MB),
        Figure(
            f"{name}, median",
            statistics.median(pressed),
            "ms",
            floor,
            1.25,
            times_floor=True,
        ),
        Figure(f"{name}, worst", max(pressed), "ms", floor),
    ]


def _pushes_ms(state_dir: Path) -> list[float]:
    times = []
    for seed in range(_PUSHES):
        items = [asdict(item) for item in random_mission(seed)]
        began_at = time.perf_counter()
        answer = ask_daemon(state_dir, {"do": "push", "source": "benchmark", "items": items})
        times.append((time.perf_counter() - began_at) * 1000)
        assert answer["ack"] == "MAV_MISSION_ACCEPTED", answer
    return times


@contextmanager
def _hostile_browsers(port: int, folder: Path) -> Iterator[None]:
    """Run the browsers, one process per address; each prints its number of responses per second."""
    with (folder / "browsers.log").open("w") as output:
        command = [sys.executable, "-m", "benchmarks.status_page", str(port)]
        browsers = [
            subprocess.Popen([*command, address], cwd=ROOT, env=ENVIRONMENT, stdin=subprocess.PIPE, stdout=output)
            for address in _ADDRESSES
        ]
        try:
            yield
        finally:
            for browser in browsers:
                browser.communicate()


def _browse(port: int, address: str) -> float:
    """Send requests until standard input ends; returns the responses per second."""
    began_at, answers = time.perf_counter(), 0
    while not select.select([sys.stdin], [], [], 0)[0]:
        for path in _PATHS:
            answers += _ask(port, address, path)
    return answers / (time.perf_counter() - began_at)


def _ask(port: int, address: str, path: str) -> bool:
    try:
        with socket.create_connection(("127.0.0.1", port), 5, (address, 0)) as connection:
            connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            answer = connection.recv(1 << 16)
            while connection.recv(1 << 16):
                pass
    except OSError:
        return False
    return answer.startswith(b"HTTP/1.1 200")


if __name__ == "__main__":
    print(_browse(int(sys.argv[1]), sys.argv[2]))
