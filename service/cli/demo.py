# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge demo`: writes a mission to a simulated Naze and verifies it.

Its ground station is pymavlink's mavutil, so that the mission is written by code not ours.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import click

from payloads.mission_data import Json, mission_findings, mission_items
from protocols.mavlink.codec import item_from_int_message
from protocols.mission_file import MissionFileError
from protocols.mission_item import MissionItem, MissionResult
from service.daemon.client import ControlError, ask_daemon
from service.machine.host import Host
from terminal.command_group import PATH
from terminal.files import load_mission
from terminal.mission_table import mission_table
from terminal.printing import console, print_table, progress_bars
from terminal.sentences import fail, say

#: A link to examples/ in the repository, a file in the installed package.
_EXAMPLE = Path(__file__).parent / "naze-field.waypoints"
#: Python's start included: about 3 s on a Pi Zero, far longer if it is busy.
_CONNECT_TIMEOUT_S = 30.0
_HEARTBEAT_INTERVAL_S = 0.2
_REPLY_TIMEOUT_S = 1.0
_TRIES = 8
_REQUESTS = ("MISSION_REQUEST", "MISSION_REQUEST_INT")


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


class ClientError(Exception):
    """The vehicle did not carry out a request, in one sentence."""


class MissionClient:
    """A connection to one vehicle (mavutil.mavfile). `texts` collects received STATUSTEXTs."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection
        self.texts: list[str] = []

    def connect(self, timeout_s: float) -> bool:
        """Wait for the heartbeat of a vehicle with a flight controller. Returns False if none arrives in time."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            self._connection.mav.heartbeat_send(6, 8, 0, 0, 4)  # a ground station
            heartbeat = self._connection.wait_heartbeat(timeout=_HEARTBEAT_INTERVAL_S)
            if heartbeat is not None and heartbeat.system_status:
                return True
        return False

    def write(self, items: Sequence[MissionItem], progress: Callable[[int], None]) -> MissionResult:
        """Upload a list. Returns the type of the final MISSION_ACK."""
        answer = self._ask(lambda mav, *target: mav.mission_count_send(*target, len(items)), *_REQUESTS, "MISSION_ACK")
        while answer.get_type() in _REQUESTS:
            progress(answer.seq)
            item = items[answer.seq]
            fields = item.seq, item.frame, item.command, 0, 1, item.p1, item.p2, item.p3, item.p4
            place = item.lat_e7 or 0, item.lon_e7 or 0, item.alt_m
            answer = self._ask(
                lambda mav, *target, fields=fields, place=place: mav.mission_item_int_send(*target, *fields, *place),
                *_REQUESTS,
                "MISSION_ACK",
            )
        progress(len(items))
        return MissionResult(answer.type)

    def read(self) -> list[MissionItem]:
        count = self._ask(lambda mav, *target: mav.mission_request_list_send(*target), "MISSION_COUNT").count
        items: list[MissionItem] = []
        while len(items) < count:
            message = self._ask(
                lambda mav, *target: mav.mission_request_int_send(*target, len(items)), "MISSION_ITEM_INT"
            )
            if message.seq == len(items):
                items.append(item_from_int_message(message))
        self._connection.mav.mission_ack_send(*self._target, 0)
        return items

    @property
    def _target(self) -> tuple[int, int]:
        return self._connection.target_system, self._connection.target_component

    def _ask(self, send: Callable[..., None], *answers: str) -> Any:
        for _ in range(_TRIES):
            send(self._connection.mav, *self._target)
            end = time.monotonic() + _REPLY_TIMEOUT_S
            while (left_s := end - time.monotonic()) > 0:
                answer = self._connection.recv_match(type=[*answers, "STATUSTEXT"], blocking=True, timeout=left_s)
                if answer is not None and answer.get_type() in answers:
                    return answer
                if answer is not None:
                    self.texts.append(answer.text)
        raise ClientError(f"no {' or '.join(answers)} from the vehicle")


@contextmanager
def connect(host: str, port: int, timeout_s: float) -> Iterator[MissionClient]:
    """Connect to the vehicle on a UDP port. Raises ClientError if no heartbeat arrives in time."""
    os.environ["MAVLINK20"] = "1"  # mavutil reads the version from the environment when it is imported
    from pymavlink import mavutil

    address = f"udpout:{host}:{port}"
    with closing(mavutil.mavlink_connection(address, source_system=255, source_component=190)) as connection:
        client = MissionClient(connection)
        if not client.connect(timeout_s):
            raise ClientError(f"no vehicle with a flight controller on UDP port {port} within {timeout_s:.0f} s")
        yield client
