# SPDX-License-Identifier: GPL-3.0-or-later
"""Vehicles and routers that disappear or hang during fleet commands do not affect the others."""

import json
import os
import pty
import re
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from fleet.roll_call import roll_call
from fleet.session import FleetError
from payloads.keys import UPLOAD
from tests.support.fleet_bench import Fleet
from tests.support.plan import judge, plain_plan, plan_text, records_of
from tests.support.programs import NAZE_BRIDGE, TIMEOUT_S, until
from tests.support.zenoh_bench import I_KNOW, ask_surely

#: At this speed 146 records take seconds, enough time to inject a fault.
_SLOW_BAUD = 9600
_COUNT = 146
_FLEET = [*NAZE_BRIDGE, "fleet"]


@pytest.fixture(scope="module")
def module_fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    """`kite` is fast, `snail` has a slow line."""
    with ExitStack() as stack:
        fleet = Fleet(tmp_path_factory.mktemp("fleet"), stack)
        board = fleet.board("snail", "--baud", str(_SLOW_BAUD))
        # A hung vehicle is considered alive for 30 s instead of 10.
        lease = fleet.folder / "lease.json5"
        lease.write_text("{transport: {link: {tx: {lease: 30000}}}}")
        commands = f'{I_KNOW}config_file = "{lease}"\n'
        fleet.start("kite", commands=commands)
        fleet.start("snail", fc=f"{board.link},{_SLOW_BAUD}", commands=commands)
        yield fleet


@pytest.fixture
def fleet(module_fleet: Fleet) -> Fleet:
    """Both vehicles are present and idle again after the previous test."""
    for daemon in module_fleet.daemons.values():
        if not daemon.is_alive:
            daemon.kill_and_restart()
    module_fleet.wait("kite", "snail")
    until(module_fleet.daemons["snail"].try_clear, "the end of a previous push")
    return module_fleet


class Command:
    """A `fleet` command that runs while faults are injected."""

    def __init__(self, fleet: Fleet, *arguments: str | Path) -> None:
        self.process = subprocess.Popen(
            [*_FLEET, *map(str, arguments), "--connect", fleet.router.endpoint],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def end(self) -> tuple[int, str, str]:
        """Wait for it; return exit status, standard output and standard error."""
        try:
            output, error = self.process.communicate(timeout=60)
        finally:
            self.process.kill()
        return self.process.returncode, output, error


def long_push(fleet: Fleet, *options: str) -> Command:
    """Start to push the long mission to all; return while the slow vehicle is receiving it."""
    file = fleet.folder / "long.waypoints"
    file.write_text(plan_text(plain_plan(_COUNT)))

    def pushes() -> int:
        return sum(event["event"] == "mission.push_started" for event in fleet.daemons["snail"].events())

    before = pushes()
    command = Command(fleet, "push", file, "--all", *options)
    until(lambda: pushes() > before, "the start of the slow push")
    return command


def outcomes(ended: tuple[int, str, str]) -> dict[str, Any]:
    code, output, error = ended
    assert (code, error) == (1, ""), ended
    return {vehicle["vehicle"]: vehicle for vehicle in json.loads(output)["vehicles"]}


def test_a_push_continues_on_the_vehicle_when_the_router_stops(fleet: Fleet) -> None:
    """The result is reported as unknown, the vehicle finishes the push, and the fleet is visible again later."""
    command = long_push(fleet, "--json")
    fleet.router.stop()
    snail = outcomes(command.end())["snail"]
    assert (snail["ok"], "router disconnected" in snail["error"]) == (False, True), snail
    until(
        lambda: fleet.boards["snail"].records() == records_of(judge(plain_plan(_COUNT))),
        "the end of the push on the vehicle",
    )
    gone = fleet.ask("list")
    assert (gone.returncode, "connection refused" in gone.stderr) == (1, True)
    fleet.router.start_again()
    until(
        lambda: {each["mission_count"] for each in fleet.listed().values()} == {_COUNT},
        "both with the mission",
    )
    fleet.boards["snail"].assert_unharmed()


def test_a_vehicle_that_disappears_during_a_push_has_failed(fleet: Fleet) -> None:
    command = long_push(fleet, "--json")
    fleet.daemons["snail"].end(signal.SIGKILL)
    found = outcomes(command.end())
    assert found["kite"]["ok"]
    assert "disconnected" in found["snail"]["error"]
    assert list(fleet.listed()) == ["kite"]


def test_ctrl_c_during_a_push_shows_which_vehicles_are_done(fleet: Fleet) -> None:
    def ends() -> int:
        return sum(event["event"] == "mission.push_ended" for event in fleet.daemons["kite"].events())

    before = ends()
    command = long_push(fleet)
    snail = fleet.daemons["snail"].process
    snail.send_signal(signal.SIGSTOP)  # so that its push ends after the other's even on a busy machine
    try:
        until(lambda: ends() > before, "the end of the fast push")
        fleet.listed()  # its replies come through the same router, after the push's
        command.process.send_signal(signal.SIGINT)
        code, output, error = command.end()
    finally:
        snail.send_signal(signal.SIGCONT)
    assert code == 130
    assert re.search(r"kite +verified", output), output
    assert re.search(r"snail +in progress", output), output
    assert error.startswith("naze-bridge: stopped; transfers in progress continue: "), error
    assert len(error.splitlines()) == 1


def test_a_second_push_during_the_first_is_refused(fleet: Fleet) -> None:
    command = long_push(fleet, "--json")
    payload = (fleet.folder / "long.waypoints").read_bytes()
    second = ask_surely(fleet.session, UPLOAD.suffix, payload, vehicle="snail")
    assert "error" in second, second
    code, _, _ = command.end()
    assert code == 0


def test_a_hung_bridge_is_listed_as_silent(fleet: Fleet) -> None:
    """On a busy machine the other one may be silent for a while, too."""

    def answers() -> dict[str, bool]:
        return {name: vehicle["answers"] for name, vehicle in fleet.listed().items()}

    def says() -> tuple[int, bool]:
        listed = fleet.ask("list")
        return listed.returncode, "1 of 2 vehicles are alive, but did not answer: kite" in listed.stderr

    def counts() -> tuple[int, int]:
        listed = json.loads(fleet.ask("list", "--json").stdout)
        return listed["alive"], listed["unanswered"]

    kite = fleet.daemons["kite"].process
    kite.send_signal(signal.SIGSTOP)
    try:
        until(lambda: answers() == {"kite": False, "snail": True}, "the silence of the hung bridge alone")
        until(lambda: says() == (1, True), "the sentence about the hung bridge alone")
        until(lambda: counts() == (2, 1), "the number of silent bridges")
    finally:
        kite.send_signal(signal.SIGCONT)
    fleet.wait("kite", "snail")


class Terminal:
    """A `fleet watch` on its own terminal; `text` is all output so far."""

    def __init__(self, fleet: Fleet) -> None:
        near, far = pty.openpty()
        environment = os.environ | {"TERM": "xterm", "COLUMNS": "120", "LINES": "40"}
        self.process = subprocess.Popen(
            [*_FLEET, "watch", "--connect", fleet.router.endpoint], stdout=far, stderr=far, env=environment
        )
        os.close(far)
        self._near = near
        self.text = ""
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        # Reading fails once the terminal's other end is closed.
        try:
            while data := os.read(self._near, 4096):
                self.text += data.decode(errors="replace")
        except OSError:
            pass

    @property
    def newest(self) -> str:
        return self.text.rpartition("Ctrl-C ends.")[2]

    def shows(self, text: str) -> None:
        """Wait until the text is shown after the present output."""
        seen = len(self.text)
        until(lambda: text in self.text[seen:], f"{text!r} on the terminal")

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(TIMEOUT_S)
        finally:
            self.process.kill()
            self._reader.join(TIMEOUT_S)
            os.close(self._near)


def test_watch_shows_vehicles_that_come_and_go(fleet: Fleet) -> None:
    terminal = Terminal(fleet)
    try:
        terminal.shows("kite")
        terminal.shows("snail")
        fleet.boards["snail"].set("armed 1")
        terminal.shows("ARMED")
        fleet.boards["snail"].set("armed 0")
        fleet.daemons["snail"].end()
        until(lambda: "kite" in terminal.newest and "snail" not in terminal.newest, "its exit on the terminal")
        fleet.router.stop()
        terminal.shows("The router is gone")
        fleet.router.start_again()
        terminal.shows("kite")
    finally:
        code = terminal.end()
    assert code == 0
    assert "Traceback" not in terminal.text


def test_a_hung_router_is_not_an_empty_fleet(fleet: Fleet) -> None:
    """The router hangs after the session was opened."""
    router = fleet.router.process
    router.send_signal(signal.SIGSTOP)
    try:
        until(lambda: _is_stopped(router.pid), "the stopped router")
        with pytest.raises(FleetError, match="the router did not list the vehicles"):
            roll_call(fleet.session, "fleet")
    finally:
        router.send_signal(signal.SIGCONT)
    fleet.wait("kite", "snail")


def _is_stopped(pid: int) -> bool:
    """SIGSTOP stops the threads one by one, and the last may still answer."""
    stats = [stat.read_text() for stat in Path(f"/proc/{pid}/task").glob("*/stat")]
    return all(stat.rpartition(")")[2].split()[0] == "T" for stat in stats)
