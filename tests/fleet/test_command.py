# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet` as used by a person and by a script: three daemons behind a router."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import zenoh

from fleet.session import open_session
from protocols.mission_file import read_mission_file
from protocols.mission_item import Command
from tests.support.doc_pages import blocks
from tests.support.fleet_bench import Fleet
from tests.support.plan import HOME, PlanRow, judge, plain_plan, plan_file, records_of, waypoint
from tests.support.programs import until
from tests.support.zenoh_router import EXAMPLES

NAMES = ("kite", "owl", "swift")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    """`swift` has an external flight controller, which can be armed."""
    with ExitStack() as stack:
        fleet = Fleet(tmp_path_factory.mktemp("fleet"), stack)
        board = fleet.board("swift")
        fleet.start("kite")
        fleet.start("owl")
        fleet.start("swift", fc=str(board.link))
        fleet.wait(*NAMES)
        yield fleet


def test_list_shows_what_each_daemon_reports(fleet: Fleet) -> None:
    def listed() -> dict[str, dict[str, Any]] | None:
        """None while a value is too old to be listed, as on a busy machine."""
        answer = fleet.ask("list", "--json")
        assert answer.returncode == 0, answer
        vehicles = {each["name"]: each for each in json.loads(answer.stdout)["vehicles"]}
        assert list(vehicles) == list(NAMES)
        known = ("protocol", "fix", "armed", "battery_v", "lat_deg")
        return None if any(each[key] is None for each in vehicles.values() for key in known) else vehicles

    vehicles = until(listed, "the values of all vehicles")
    for name, vehicle in vehicles.items():
        status = fleet.daemons[name].status()
        assert status is not None
        assert (vehicle["protocol"], vehicle["fix"]) == ("MSP", status["fix"])
        assert vehicle["armed"] is False
        assert vehicle["mission_checksum"] == status["mission_checksum"]
        assert 5 < vehicle["battery_v"] < 30
        assert -90 < vehicle["lat_deg"] < 90
    table = fleet.ask("list").stdout
    assert [name for name in NAMES if name not in table] == []
    assert [line for line in table.splitlines() if len(line) > 80 or line != line.rstrip()] == []


def test_a_list_pushed_to_all_is_pulled_from_each(fleet: Fleet, tmp_path: Path) -> None:
    plan = plain_plan(9, start=20)
    pushed = fleet.ask("push", plan_file(tmp_path, plan), "--all")
    assert (pushed.returncode, pushed.stderr) == (0, ""), pushed
    assert pushed.stdout.endswith("3 of 3 vehicles hold the mission, verified\n")
    records = records_of(judge(plan))
    assert [fleet.daemons[name].pull()["records"] for name in NAMES] == [records] * 3
    wanted = {(9, fleet.daemons["kite"].pull()["checksum"])}
    found = ("mission_count", "mission_checksum")
    until(lambda: {tuple(map(each.get, found)) for each in fleet.listed().values()} == wanted, "the news")
    folder = tmp_path / "pulled"
    assert fleet.ask("pull", folder).returncode == 0
    assert sorted(path.name for path in folder.iterdir()) == [f"{name}.waypoints" for name in NAMES]
    for path in folder.iterdir():
        held = read_mission_file(path.read_bytes(), path.name)
        assert [item.lat_e7 for item in held[1:]] == [int(row.lat * 1e7) for row in plan[1:]]


def test_push_and_pull_act_only_on_the_named_vehicle(fleet: Fleet, tmp_path: Path) -> None:
    before = fleet.daemons["kite"].pull()["records"]
    pushed = fleet.pushed(plan_file(tmp_path, plain_plan(4, start=60)), "--vehicle", "owl", code=0)
    assert (list(pushed), pushed["owl"]["ok"]) == (["owl"], True)
    assert fleet.daemons["kite"].pull()["records"] == before
    until(lambda: fleet.listed()["owl"]["mission_count"] == 4, "the news")
    shown = fleet.ask("pull", "--vehicle", "owl").stdout
    assert shown.startswith(f"owl: 4 records, checksum {fleet.daemons['owl'].pull()['checksum']}\n")
    file = tmp_path / "owls"
    assert fleet.ask("pull", file, "--vehicle", "owl").returncode == 0
    assert len(read_mission_file(file.read_bytes(), "owls")) == 4
    printed = fleet.ask("pull", "-", "--vehicle", "owl")
    assert (printed.returncode, printed.stdout) == (0, file.read_text())
    assert printed.stderr == shown.splitlines()[0] + "\n"
    assert fleet.ask("pull", "-").returncode == 2
    data = json.loads(fleet.ask("pull", "--vehicle", "owl", "--vehicle", "kite", "--json").stdout)["vehicles"]
    assert [(each["vehicle"], each["error"]) for each in data] == [("owl", None), ("kite", None)]


def test_push_reports_each_vehicles_changes(fleet: Fleet, tmp_path: Path) -> None:
    plan = [*plain_plan(4, start=90), PlanRow(178, p2=5.0)]
    pushed = fleet.ask("push", plan_file(tmp_path, plan), "--vehicle", "kite")
    assert "4 of 5 stored: 1 dropped, " in pushed.stdout, pushed


def test_a_list_that_breaks_a_rule_is_refused_by_each(fleet: Fleet, tmp_path: Path) -> None:
    file = plan_file(tmp_path, [HOME, PlanRow(Command.NAV_LAND), waypoint(1)])
    pushed = fleet.pushed(file, "--all", code=1)
    assert {name: each["error"] for name, each in pushed.items()} == dict.fromkeys(
        NAMES, "Rejected, WP 1: LAND must be last"
    )


def test_an_armed_vehicle_refuses_a_push_to_all(fleet: Fleet, tmp_path: Path) -> None:
    file = plan_file(tmp_path, plain_plan(5, start=100))
    swift, board = fleet.daemons["swift"], fleet.boards["swift"]
    before = board.records()
    board.set("armed 1")
    try:
        until(lambda: fleet.listed()["swift"]["armed"], "the state with armed")
        assert "ARMED" in fleet.ask("list").stdout
        pushed = fleet.pushed(file, "--all", code=1)
        assert {name: each["ok"] for name, each in pushed.items()} == {"kite": True, "owl": True, "swift": False}
        assert "rmed" in pushed["swift"]["error"]
        assert board.records() == before
        result = fleet.ask("push", file, "--all")
        assert result.returncode == 1
        assert result.stdout.endswith("2 of 3 vehicles hold the mission, verified; 1 failed\n")
    finally:
        board.set("armed 0")
        until(lambda: (swift.status() or {}).get("armed") is False, "the landing")


def test_an_unknown_name_is_reported_in_one_sentence(fleet: Fleet, tmp_path: Path) -> None:
    file = plan_file(tmp_path, plain_plan(4))
    for command in (["push", file], ["pull"]):
        ended = fleet.ask(*command, "--vehicle", "kita")
        assert (ended.returncode, ended.stdout) == (1, "")
        assert ended.stderr == "naze-bridge: no vehicle 'kita' is alive; there are kite, owl, swift\n"


def test_invalid_states_of_strangers_are_ignored(fleet: Fleet) -> None:
    """Tokens and states of other programs neither stop the list nor reach the terminal."""
    with ExitStack() as stack:
        session = stack.enter_context(open_session((fleet.router.endpoint,)))
        liveliness = session.liveliness()
        for key in (
            "fleet/ghost/v1/alive/0",
            "fleet/spa ce/v1/alive/1",
            "fleet/ghost/v1/alive/0/more",
            "fleet/\x1b[2J/v1/alive/2",
        ):
            stack.enter_context(liveliness.declare_token(key))
        answers = (b"\xff", b"[" * 100_000, b'{"link": 3, "battery": {"voltage_v": "\x1b[2J"}}', b"[]")

        def lie(query: zenoh.Query) -> None:
            with query:
                for answer in answers:
                    query.reply("fleet/ghost/v1/overview", answer)

        stack.enter_context(session.declare_queryable("fleet/ghost/v1/overview", lie))
        until(lambda: "ghost" in fleet.listed(), "the ghost")

        def listed() -> str | None:
            """None while others are silent, too, as on a busy machine."""
            answer = fleet.ask("list")
            is_alone = answer.stderr.endswith("1 of 4 vehicles are alive, but did not answer: ghost\n")
            return answer.stdout + answer.stderr if is_alone else None

        assert "\x1b" not in until(listed, "the silence of the ghost alone")
        assert set(fleet.listed()) == {"ghost", *NAMES}


def test_the_example_programs_work(fleet: Fleet, tmp_path: Path) -> None:
    file = plan_file(tmp_path, plain_plan(6, start=120))
    for name in ("zenoh_positions.py", "zenoh_upload.py"):
        told = subprocess.run([sys.executable, EXAMPLES / name, "--help"], capture_output=True, text=True, check=False)
        assert (told.returncode, told.stderr, "usage: " in told.stdout) == (0, "", True), told
    upload = [sys.executable, str(EXAMPLES / "zenoh_upload.py")]
    uploaded = subprocess.run(
        [*upload, "kite", str(file), fleet.router.endpoint], capture_output=True, text=True, timeout=60, check=False
    )
    assert (uploaded.returncode, uploaded.stderr) == (0, ""), uploaded
    assert "6 of 6 stored: " in uploaded.stdout
    output = tmp_path / "positions"
    with output.open("w") as log:
        positions = subprocess.Popen(
            [sys.executable, str(EXAMPLES / "zenoh_positions.py"), fleet.router.endpoint], stdout=log, stderr=log
        )
    try:
        until(lambda: {"kite:", "swift:"} <= set(output.read_text().split()), "positions of two vehicles")
    finally:
        positions.kill()
        positions.wait()


@pytest.mark.skipif("EXAMPLE_IN_RUST" not in os.environ, reason="minutes with cargo: EXAMPLE_IN_RUST=BUILD_FOLDER")
def test_the_example_in_rust_works(fleet: Fleet, tmp_path: Path) -> None:
    built = os.environ["EXAMPLE_IN_RUST"]
    folder = ["--manifest-path", str(EXAMPLES / "rust" / "Cargo.toml"), "--target-dir", built]
    subprocess.run(["cargo", "build", "--quiet", *folder], check=True)
    output = tmp_path / "positions.txt"
    with output.open("w") as log:
        positions = subprocess.Popen([f"{built}/debug/positions", fleet.router.endpoint], stdout=log, stderr=log)
    try:
        until(lambda: "fleet/kite/v1/telemetry/position: {" in output.read_text(), "a position")
    finally:
        positions.kill()
        positions.wait()


def test_the_subscriber_in_the_docs_works(fleet: Fleet, tmp_path: Path) -> None:
    (code,) = (block.text for block in blocks() if block.language == "python")
    output = tmp_path / "samples"
    with output.open("w") as log:
        command = [sys.executable, "-c", code.replace("tcp/192.168.4.1:7447", fleet.router.endpoint)]
        reader = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        until(lambda: "fleet/kite/v1/telemetry/position b'{" in output.read_text(), "a position")
    finally:
        reader.kill()
        reader.wait()


def test_two_bridges_with_one_name_refuse_missions(fleet: Fleet, tmp_path: Path) -> None:
    other = fleet.start("other", name="owl")
    try:
        until(lambda: fleet.listed()["owl"]["bridges"] == 2, "the second owl")
        assert "owl: 2 bridges use this name" in " ".join(fleet.ask("list").stderr.split())
        before = fleet.daemons["owl"].pull()["records"]
        pushed = fleet.pushed(plan_file(tmp_path, plain_plan(4, start=7)), "--vehicle", "owl", code=1)
        assert "another bridge has the same vehicle name" in pushed["owl"]["error"]
        assert fleet.daemons["owl"].pull()["records"] == before
        assert "several bridges use this name" in fleet.ask("pull", "--vehicle", "owl").stderr
    finally:
        other.end()
    until(lambda: fleet.listed()["owl"]["bridges"] == 1, "the second owl's disappearance")


def test_a_vehicle_without_commands_is_reported(fleet: Fleet, tmp_path: Path) -> None:
    deaf = fleet.start("deaf", commands="")
    try:
        fleet.wait("deaf")
        pushed = fleet.pushed(plan_file(tmp_path, plain_plan(4, start=8)), "--vehicle", "deaf", code=1)
        assert "accepts no commands" in pushed["deaf"]["error"]
    finally:
        deaf.end()
