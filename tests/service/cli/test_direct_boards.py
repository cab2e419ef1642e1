# SPDX-License-Identifier: GPL-3.0-or-later
"""Every command with `--fc`, on every simulated board."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from protocols.mission_file import read_mission_file
from protocols.mission_item import Command
from simulator.board.nav_waypoint import FLAG_LAST, NavWaypoint
from simulator.commands.fc_kinds import KINDS
from simulator.inav.mission import CAPACITY
from simulator.inav.places import PLACES_SIZE
from simulator.inav.settings import SETTINGS_SIZE
from tests.support.benches import Starter
from tests.support.plan import HOME, PlanRow, plan_text, waypoint
from tests.support.programs import Board, run_naze_bridge

STORES_MISSIONS = ("naze", "inav", "multiwii")
STORES_NONE = ("betaflight", "baseflight")
assert {*STORES_MISSIONS, *STORES_NONE} == {"naze", *KINDS}
PLAN = [HOME, waypoint(1), waypoint(2), PlanRow(Command.NAV_ROI, 45.3843398, 8.4742597), waypoint(3)]


@pytest.fixture(scope="module", params=STORES_MISSIONS)
def board(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Board]:
    with ExitStack() as stack:
        kind = () if request.param == "naze" else ("--kind", request.param)
        yield Starter(tmp_path_factory.mktemp(request.param), stack).board(*kind)


@pytest.fixture(scope="module", params=STORES_NONE)
def other_board(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Board]:
    with ExitStack() as stack:
        yield Starter(tmp_path_factory.mktemp(request.param), stack).board("--kind", request.param)


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    file = tmp_path / "plan.waypoints"
    file.write_text(plan_text(PLAN))
    return file


def test_push_pull_and_clear_work(board: Board, plan_file: Path, tmp_path: Path) -> None:
    commands = [row.command for row in PLAN]
    pushed = run_naze_bridge("push", plan_file, "--json", "--fc", board.link)
    assert (pushed.returncode, pushed.stderr.strip()) == (0, "")
    assert json.loads(pushed.stdout)["ack"] == "MAV_MISSION_ACCEPTED"
    pulled = run_naze_bridge("pull", tmp_path / "held", "--fc", board.link)
    assert (pulled.returncode, pulled.stderr) == (0, "")
    held = read_mission_file((tmp_path / "held").read_bytes(), "held")
    assert [item.command for item in held] == commands
    items = json.loads(run_naze_bridge("pull", "--json", "--fc", board.link).stdout)["items"]
    assert [item["command"] for item in items] == commands
    cleared = run_naze_bridge("clear", "--fc", board.link)
    assert (cleared.returncode, cleared.stdout) == (0, "ACCEPTED: Mission on the flight controller cleared\n")
    assert run_naze_bridge("pull", "--fc", board.link).stdout.startswith("0 records")


def assert_status(board: Board) -> None:
    status = json.loads(run_naze_bridge("status", "--json", "--fc", board.link).stdout)
    assert (status["state"], status["armed"]) == ("MSP", False)


def test_status_and_doctor_work(board: Board) -> None:
    assert_status(board)
    assert "Flight controller" in run_naze_bridge("status", "--fc", board.link).stdout
    assert "Traceback" not in (diagnosis := run_naze_bridge("doctor", "--fc", board.link)).stderr
    assert str(board.link) in diagnosis.stdout


def test_a_board_without_missions_gives_the_reason_and_the_status(other_board: Board, plan_file: Path) -> None:
    sentence = "This flight controller cannot store missions"
    refused = run_naze_bridge("push", plan_file, "--fc", other_board.link)
    assert (refused.returncode, refused.stderr.strip()) == (1, "")
    assert refused.stdout.splitlines()[-1] == f"UNSUPPORTED: {sentence}"
    pulled = run_naze_bridge("pull", "--fc", other_board.link)
    assert (pulled.returncode, pulled.stderr) == (1, f"naze-bridge: {sentence}\n")
    assert_status(other_board)


def test_pull_all_reads_missions_that_are_not_loaded(tmp_path: Path) -> None:
    with ExitStack() as stack:
        eeprom = tmp_path / "eeprom"
        ends = {3: FLAG_LAST, 8: FLAG_LAST}
        saved = [NavWaypoint(1, 453838000, 84733000, 2000, flag=ends.get(n, 0)) for n in range(1, 9)]
        saved += [NavWaypoint()] * (CAPACITY - len(saved))
        missions = b"".join(waypoint.pack(number) for number, waypoint in enumerate(saved, 1))
        eeprom.write_bytes(missions + bytes(SETTINGS_SIZE + PLACES_SIZE))
        board = Starter(tmp_path, stack).board("--kind", "inav", "--state", str(eeprom))
        assert run_naze_bridge("pull", "--fc", board.link).stdout.endswith("1 more in its store: see --all\n")
        pulled = run_naze_bridge("pull", tmp_path / "held.waypoints", "--all", "--fc", board.link)
    assert (pulled.returncode, pulled.stderr) == (0, "")
    files = (tmp_path / "held.waypoints", tmp_path / "held-2.waypoints")
    assert [len(read_mission_file(file.read_bytes(), file.name)) for file in files] == [4, 6]
