# SPDX-License-Identifier: GPL-3.0-or-later
"""Floods of the disk and the control socket, and a disk that is missing or hangs."""

import os
import shutil
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

from protocols.mavlink.frame import MavlinkSplitter
from tests.support.attack_pilot import HELLO, Attack, Stranger, Watch, assert_uploads, m
from tests.support.benches import Starter
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import NAZE_BRIDGE, REPOSITORY, Daemon, free_port, happens, run_naze_bridge, until
from tests.support.web_bench import WebBench


def logs(state_dir: Path) -> list[Path]:
    return sorted((state_dir / "logs").glob("*.tlog"))


def test_the_log_of_a_flight_survives_a_flood(start: Starter, stack: ExitStack) -> None:
    bench = start.bench(config="tlog_total_mb = 3\n")
    state = bench.daemon.state_dir
    pilot = Stranger(bench.daemon.address, sysid=255)
    stack.callback(pilot.close)
    pilot.send(HELLO)
    bench.board.set("armed 1")
    until(lambda: any("flight" in path.name for path in logs(state)), "the log of a flight")
    (flight,) = [path for path in logs(state) if "flight" in path.name]
    bench.board.set("armed 0")
    stranger = Stranger(bench.daemon.address)
    stack.callback(stranger.close)
    text = m.MAVLink_statustext_message(6, b"x" * 50)
    with Watch(bench.daemon), Attack(lambda: stranger.send(*[text] * 50), per_s=40) as attack:
        assert happens(lambda: attack.count > 300)
    assert flight in logs(state)
    # The 1.2 MB of the flood are not recorded.
    assert sum(path.stat().st_size for path in logs(state)) < 600_000


def test_refused_frames_are_not_recorded(start: Starter, stack: ExitStack) -> None:
    link = f"udpin:127.0.0.1:{free_port()}"
    bench = start.bench(gcs=[link], config=f'gcs = [{{address = "{link}", key_file = "{start.key_file()}"}}]\n')
    stranger = Stranger(("127.0.0.1", int(link.rpartition(":")[2])), sysid=77)
    stack.callback(stranger.close)
    for _ in range(20):
        stranger.send(HELLO, m.MAVLink_param_request_list_message(1, 1), m.MAVLink_mission_clear_all_message(1, 1))
    until(lambda: "20 x" in str(bench.daemon.ask({"do": "status"})["refused"]), "the refusals")
    assert bench.daemon.end() == 0
    recorded = b"".join(path.read_bytes() for path in logs(bench.daemon.state_dir))
    assert 77 not in {frame.sysid for frame in MavlinkSplitter().feed(recorded)}


def test_without_a_state_directory_the_daemon_keeps_working(start: Starter, tmp_path: Path) -> None:
    blocked = tmp_path / "blocked"
    blocked.write_text("a file in place of the folder")
    board = start.board()
    port = free_port(socket.SOCK_STREAM)
    config = f'[web]\nlisten = "127.0.0.1:{port}"\n'
    daemon = start.daemon(str(board.link), state_dir=blocked / "state", config=config)
    daemon.wait()
    with Watch(daemon) as monitor, udp_station(daemon.address) as pilot:
        pilot.send(HELLO)
        pilot.send(HELLO)  # its address is proven
        assert "memory" in pilot.wait_for("STATUSTEXT").text
        assert_uploads(pilot, board, plain_plan(20))
        until(lambda: len(monitor.gaps_s) >= 3, "heartbeats")
    assert [kept["outcome"] for kept in daemon.missions()] == ["VERIFIED"]
    status = daemon.status()
    assert status is not None
    assert "cannot" in status["store_trouble"]
    assert "kept in memory only" in run_naze_bridge("status", "--state-dir", daemon.state_dir).stdout
    second = run_naze_bridge(
        "run", "--fc", "sim:", "--gcs", f"udpin:127.0.0.1:{free_port()}", "--state-dir", daemon.state_dir
    )
    assert (second.returncode, "another daemon answers on" in second.stderr) == (1, True), second
    until(lambda: daemon.has_logged("web.listening"), "the page")
    page = WebBench(daemon, None, port)
    assert page.ask("/api/state").data["store_trouble"] == status["store_trouble"]
    refused = page.ask("/api/missions/1/restore", "POST", Authorization="Bearer none")
    assert refused.status == 403
    assert "read-only" in refused.data["error"]


class FreshDaemon(Daemon):
    """A daemon in a new interpreter."""

    command: tuple[str, ...] = ()

    def _start(self) -> subprocess.Popen[bytes]:
        with self._output.open("ab") as output:
            return subprocess.Popen([*self.command, *self._arguments], cwd=REPOSITORY, stdout=output, stderr=output)


_HANGING = """
import os, threading
from storage.mission_store import MissionStore
def hang(*arguments): threading.Event().wait()
os.fsync = os.fdatasync = MissionStore.add = MissionStore.close = hang
from service.cli.main import main
main(prog_name="naze-bridge")
"""


class DaemonWithoutDisk(FreshDaemon):
    """The disk never responds, like an SD card that hangs in the kernel."""

    command = (sys.executable, "-c", _HANGING)


def test_the_daemon_works_and_stops_while_the_disk_hangs(start: Starter, stack: ExitStack) -> None:
    board = start.board()
    daemon = DaemonWithoutDisk(start.directory, str(board.link))
    stack.callback(daemon.end, signal.SIGKILL)
    daemon.wait()
    with udp_station(daemon.address) as pilot:
        assert_uploads(pilot, board, plain_plan(20))
    assert daemon.end() == 0
    assert "store.hangs" in daemon.printed


#: Without root's right to ignore the modes of files.
_OBEYING_MODES = ("setpriv", "--bounding-set=-dac_override", "--inh-caps=-dac_override") if os.geteuid() == 0 else ()
_SAVED_NOTHING = {
    "read-only": ("signing.json", "Permission denied"),
    "removed": ("signing.json", "No such file or directory", "missions.db was removed while in use"),
    "a file": ("signing.json", "Not a directory", "missions.db was removed while in use"),
}


class DaemonThatObeysModes(FreshDaemon):
    """Runs without root's right to ignore the modes of files."""

    command = (*_OBEYING_MODES, *NAZE_BRIDGE)


@pytest.mark.parametrize("becomes", _SAVED_NOTHING)
def test_the_daemon_stops_cleanly_after_the_state_folder_was_lost(
    start: Starter, stack: ExitStack, becomes: str
) -> None:
    """What could not be saved is logged once."""
    link = f"udpin:127.0.0.1:{free_port()}"
    config = f'gcs = [{{address = "{link}", key_file = "{start.key_file()}"}}]\n'
    daemon = DaemonThatObeysModes(start.directory, "sim:", [link], config=config)
    stack.callback(daemon.end, signal.SIGKILL)
    daemon.wait()
    if becomes == "read-only":
        daemon.state_dir.chmod(0o555)
        stack.callback(daemon.state_dir.chmod, 0o755)
    else:
        shutil.rmtree(daemon.state_dir)
        if becomes == "a file":
            daemon.state_dir.touch()
    assert daemon.end() == 0, daemon.printed
    assert "Traceback" not in daemon.printed
    ending = daemon.printed[daemon.printed.index("daemon.stopping") :]
    assert [ending.count(words) for words in _SAVED_NOTHING[becomes]] == [1] * len(_SAVED_NOTHING[becomes]), ending


#: Sockets that a client opens for each request: far above every limit.
CONNECTIONS = 250
#: 16 of the control socket, 200 of the page, 32 ground stations, and the daemon's own files.
MOST_OPEN_FILES = 300


def test_connections_and_unread_replies_are_limited(start: Starter) -> None:
    """Each connection carries half a request, or an expensive one whose reply is not read."""
    page, tcp, udp = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM), free_port()
    links = [f"udpin:127.0.0.1:{udp}", f"tcpin:127.0.0.1:{tcp}"]
    bench = start.bench(gcs=links, config=f'[web]\nlisten = "127.0.0.1:{page}"\n')
    daemon = bench.daemon
    daemon.port = udp
    daemon.push(plain_plan(140))
    until(lambda: daemon.has_logged("web.listening"), "the page")
    control = str(daemon.state_dir / "control.sock")
    parameters = bytes(m.MAVLink_param_request_list_message(1, 1).pack(m.MAVLink(None)))
    targets: list[tuple[int, Any, bytes]] = [
        (socket.AF_UNIX, control, b'{"do": "mission", "number": 1}\n'),
        (socket.AF_UNIX, control, b'{"do"'),
        (socket.AF_INET, ("127.0.0.1", page), b"GET / HTTP/1.1\r\n"),
        (socket.AF_INET, ("127.0.0.1", tcp), parameters * 50),
    ]
    process = daemon.process.pid
    before, memory = _open_files(process), _memory_kb(process)
    with Watch(daemon) as monitor, ExitStack() as clients:
        for family, address, request in targets:
            for _ in range(CONNECTIONS):
                client = clients.enter_context(socket.socket(family))
                client.settimeout(0.2)
                with suppress(OSError):  # the daemon has disconnected, or its backlog is full
                    client.connect(address)
                    client.sendall(request)
            received = len(monitor.gaps_s)
            until(lambda received=received: len(monitor.gaps_s) > received, "a heartbeat")  # type: ignore[misc]
            assert _open_files(process) < MOST_OPEN_FILES
        assert _memory_kb(process) - memory < 15_000
        with udp_station(daemon.address) as pilot:
            assert_uploads(pilot, bench.board, plain_plan(20))
    # Up to three more than before: the telemetry log, and sockets for the stations of the monitor and the pilot.
    until(lambda: _open_files(process) <= before + 3, "the end of the connections")
    assert "Traceback" not in daemon.printed
    assert happens(lambda: daemon.status() is not None)


def test_a_long_source_is_truncated(start: Starter) -> None:
    bench = start.bench()
    with Watch(bench.daemon) as monitor:
        until(lambda: len(monitor.gaps_s) >= 1, "a heartbeat")
        for _ in range(5):
            bench.daemon.ask({"do": "push", "source": "y" * 250_000, "items": []})
        until(lambda: len(monitor.gaps_s) >= 4, "heartbeats")
    assert monitor.frames[m.MAVLINK_MSG_ID_STATUSTEXT] < 60


def test_requests_of_a_megabyte_do_not_fill_the_memory(start: Starter) -> None:
    """A list of empty items takes thirty times as much memory as its text."""
    bench = start.bench()
    before = _memory_kb(bench.daemon.process.pid)
    request = b'{"do": "push", "items": [' + b"{}," * 300_000 + b"{}]}\n"
    with Watch(bench.daemon) as monitor, ExitStack() as clients:
        for _ in range(16):
            client = clients.enter_context(socket.socket(socket.AF_UNIX))
            client.connect(str(bench.daemon.state_dir / "control.sock"))
            with suppress(OSError):  # the daemon has disconnected
                client.sendall(request)
        until(lambda: len(monitor.gaps_s) >= 2, "heartbeats")
    assert _memory_kb(bench.daemon.process.pid, "VmHWM") - before < 15_000
    assert happens(lambda: bench.daemon.status() is not None)


def _open_files(pid: int) -> int:
    return len(os.listdir(f"/proc/{pid}/fd"))


def _memory_kb(pid: int, figure: str = "VmRSS") -> int:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{figure}:"))
