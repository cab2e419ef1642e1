# SPDX-License-Identifier: GPL-3.0-or-later
"""One mission for many vehicles: dry runs, stages, comparison by checksum."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from protocols.mission_item import Command
from tests.support.fleet_bench import Fleet, running_fleet
from tests.support.plan import HOME, PlanRow, plain_plan, plan_file, waypoint
from tests.support.programs import run_naze_bridge, until

NAMES = ("kite", "owl", "swift")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with running_fleet(tmp_path_factory.mktemp("fleet"), *NAMES) as fleet:
        yield fleet


def test_a_dry_run_reports_corrections_without_writing(fleet: Fleet, tmp_path: Path) -> None:
    before = [fleet.daemons[name].pull() for name in NAMES]
    file = plan_file(tmp_path, [*plain_plan(4, start=90), PlanRow(178, p2=5.0)])
    tried = fleet.ask("push", file, "--all", "--dry-run")
    assert tried.returncode == 0, tried
    assert tried.stdout.endswith("3 of 3 vehicles would accept the mission; nothing was written\n")
    assert tried.stdout.count("WP 4: DO_CHANGE_SPEED dropped") == 1
    assert [fleet.daemons[name].pull() for name in NAMES] == before
    bad = fleet.ask("push", plan_file(tmp_path, [HOME, PlanRow(Command.NAV_LAND), waypoint(1)]), "--all", "--dry-run")
    assert bad.returncode == 1
    assert bad.stdout.count("Rejected, WP 1: LAND must be last") == 3


def test_a_file_without_storable_items_keeps_the_mission(fleet: Fleet, tmp_path: Path) -> None:
    fleet.pushed(plan_file(tmp_path, plain_plan(4)), "--vehicle", "kite", code=0)
    nothing = plan_file(tmp_path, [HOME, PlanRow(178, p2=5.0)])
    tried = fleet.ask("push", nothing, "--vehicle", "kite", "--dry-run")
    assert (tried.returncode, "none of its items can be stored" in tried.stdout) == (1, True), tried
    pushed = fleet.pushed(nothing, "--vehicle", "kite", code=1)
    assert "would erase the mission" in pushed["kite"]["error"]
    assert fleet.daemons["kite"].pull()["count"] == 4


def test_a_mission_is_verified_by_checksum(fleet: Fleet, tmp_path: Path) -> None:
    file = plan_file(tmp_path, plain_plan(6, start=30))
    fleet.pushed(file, "--vehicle", "kite", "--vehicle", "owl", code=0)
    verified = fleet.ask("verify", file, "--all", "--json")
    assert verified.returncode == 1, verified
    vehicles = {each["vehicle"]: each for each in json.loads(verified.stdout)["vehicles"]}
    assert {name: each["is_held"] for name, each in vehicles.items()} == {"kite": True, "owl": True, "swift": False}
    checked = json.loads(run_naze_bridge("check", file, "--json").stdout)
    assert checked["checksum"] == vehicles["swift"]["checksum"] == fleet.daemons["kite"].pull()["checksum"]
    shown = fleet.ask("verify", file, "--vehicle", "swift").stdout.splitlines()
    assert shown[-2].split()[:4] == ["swift", "0", "none", "no"]
    assert f"the file would be 6 records, {checked['checksum']}" in shown[-2]
    result = fleet.ask("verify", file, "--vehicle", "kite", "--vehicle", "owl")
    assert (result.returncode, result.stdout.splitlines()[-1]) == (0, "2 of 2 vehicles hold the mission")


def test_a_staged_push_stops_at_the_first_failure(fleet: Fleet, tmp_path: Path) -> None:
    before = [fleet.daemons[name].pull()["records"] for name in NAMES]
    bad = plan_file(tmp_path, [HOME, PlanRow(Command.NAV_LAND), waypoint(1)])
    pushed = fleet.pushed(bad, "--all", "--staged", code=1)
    assert "LAND must be last" in pushed["kite"]["error"]
    assert [pushed[name]["error"] for name in NAMES[1:]] == ["kite had failed"] * 2
    assert [fleet.daemons[name].pull()["records"] for name in NAMES] == before
    file = plan_file(tmp_path, plain_plan(5))
    fleet.pushed(file, "--vehicle", "kite", code=0)
    pushed = fleet.pushed(file, "--all", "--staged", code=0)
    assert [pushed[name]["ok"] for name in NAMES] == [True] * 3
    # A push that was interrupted continues: this vehicle had it.
    assert pushed["kite"]["result"]["text"] == "Mission held already: 5 records"


def test_a_staged_push_stops_at_an_armed_vehicle(tmp_path: Path) -> None:
    with ExitStack() as stack:
        fleet = Fleet(tmp_path, stack)
        fleet.start("kite")
        board = fleet.board("owl")
        fleet.start("owl", fc=board.fc)
        fleet.start("swift")
        fleet.wait(*NAMES)
        board.set("armed 1")
        until(lambda: fleet.listed()["owl"]["armed"], "the arming")
        pushed = fleet.pushed(plan_file(tmp_path, plain_plan(5)), "--all", "--staged", code=1)
        assert [pushed[name]["ok"] for name in NAMES] == [True, False, False]
        assert "disarm" in pushed["owl"]["error"]
        assert pushed["swift"]["error"] == "owl had failed"
        assert fleet.daemons["swift"].pull()["count"] == 0
