# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge demo`: writes a mission to a simulated Naze and verifies it."""

import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from payloads.mission_data import Json, mission_findings, mission_items
from protocols.mission_file import MissionFileError
from protocols.mission_item import MissionItem, MissionResult
from service.cli.mission_client import ClientError, connect
from service.daemon.client import ControlError, ask_daemon
from service.machine.host import Host
from terminal.files import load_mission
from terminal.mission_table import mission_table
from terminal.options import PATH
from terminal.printing import console, print_table, progress_bars
from terminal.sentences import fail, say

#: A link to examples/ in the repository, a file in the installed package.
_EXAMPLE = Path(__file__).parent / "naze-field.waypoints"
#: Python's start included: about 3 s on a Pi Zero, far longer if it is busy.
_CONNECT_TIMEOUT_S = 30.0


@click.command()
@click.argument("file", type=PATH, default=_EXAMPLE)
@click.option("--once", is_flag=True, help="Exit after the demonstration.")
@click.option("--port", type=click.IntRange(1, 65535), default=14550, show_default=True, help="UDP port.")
def demo(file: Path, once: bool, port: int) -> None:
    """Start the daemon on a simulated Naze, write a mission FILE to it over UDP, and show the result."""
    # The daemon is a child of this program, so that both end together, even when the terminal is closed.
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _frame: sys.exit(128 + number))
    try:
        items = load_mission(file)
        state_dir = Path(tempfile.mkdtemp(prefix="naze-bridge-demo-"))
        try:
            port = _free_port(port)
            with _daemon(port, state_dir) as process:
                _show(items, file, port, state_dir)
                if not once:
                    _stay(port, process, state_dir)
        finally:
            shutil.rmtree(state_dir, ignore_errors=True)
    except MissionFileError as error:
        raise click.UsageError(str(error)) from error
    except (ClientError, ControlError) as error:
        fail(error)


def _show(items: list[MissionItem], file: Path, port: int, state_dir: Path) -> None:
    with connect("127.0.0.1", port, _CONNECT_TIMEOUT_S) as client:
        say(f"Writing {file.name}, {len(items)} items, over UDP port {port} ...")
        with progress_bars(console()) as bar:
            task = bar.add_task("Upload", total=len(items))
            result = client.write(items, lambda done: bar.update(task, completed=done))
        say(f"The vehicle answers MAV_MISSION_{result.name}.\n")
        received = _latest_mission(state_dir)
        held = client.read()
    findings = mission_findings(received["findings"])
    print_table(mission_table(items, held, findings, received["sent_seqs"]))
    if result is not MissionResult.ACCEPTED:
        raise ClientError(f"the mission was not accepted: {'; '.join(client.texts)}")
    if held != mission_items(received["stored_items"]):
        raise ClientError("the mission read back differs from the stored one")
    say(f"\nSent {len(items)} items; the flight controller holds {len(held)}, read back from it and compared.")


def _stay(port: int, process: subprocess.Popen[bytes], state_dir: Path) -> None:
    addresses = ", ".join(Host().ipv4_addresses()) or "this machine's address"
    say(
        f"\nThe bridge keeps running. In Mission Planner choose UDPCl, host {addresses}, port {port}, and press Connect"
        "\n(QGroundControl, MAVProxy and MAVSDK: udpout / udp client to the same address). Ctrl-C ends.\n"
        f"The daemon's log: {state_dir / 'daemon.log'}"
    )
    try:
        process.wait()
    except KeyboardInterrupt:
        say("")  # the shell's prompt starts on a new line


def _latest_mission(state_dir: Path) -> Json:
    newest = ask_daemon(state_dir, {"do": "missions", "limit": 1})["missions"][0]
    received: Json = ask_daemon(state_dir, {"do": "mission", "number": newest["number"]})["received"]
    return received


@contextmanager
def _daemon(port: int, state_dir: Path) -> Iterator[subprocess.Popen[bytes]]:
    arguments = ["run", "--fc", "sim:", "--gcs", f"udpin:0.0.0.0:{port}", "--state-dir", str(state_dir)]
    click.secho(f"$ naze-bridge {' '.join(arguments)}", bold=True)
    program = [sys.executable, "-c", "from service.cli.program import start; start()"]
    log = state_dir / "daemon.log"
    with log.open("wb") as stderr, subprocess.Popen([*program, *arguments], stderr=stderr) as process:  # noqa: S603
        try:
            yield process
        finally:
            process.terminate()


def _free_port(wanted: int) -> int:
    """`wanted`, or another port if a ground station on this machine uses it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("0.0.0.0", wanted))  # noqa: S104  # reachable over Wi-Fi
        except OSError:
            probe.bind(("0.0.0.0", 0))  # noqa: S104
            say(f"UDP port {wanted} is in use; using another one.")
        port: int = probe.getsockname()[1]
        return port
