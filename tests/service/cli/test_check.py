# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge check` as used by a person and by a script."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from protocols.mission_file import read_mission_file, write_qgc_wpl
from protocols.mission_item import MissionItem
from protocols.msp.mission import unpack_records
from service.cli.main import main

EXAMPLES = Path(__file__).parents[3] / "examples"
FIELD, PLAN, LONG = (EXAMPLES / name for name in ("naze-field.waypoints", "naze-field.plan", "long-146.waypoints"))

HOME = MissionItem(0, 16, 0, 0.0, 2.0, 0.0, 0.0, 453838000, 84733000, 131.0)
POINT = MissionItem(1, 16, 3, 0.0, 2.0, 0.0, 0.0, 453839000, 84734000, 10.0)
LAND = MissionItem(1, 21, 3, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
SPEED = MissionItem(1, 178, 3, 1.0, 4.0, 0.0, 0.0, 0, 0, 0.0)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["check", *map(str, arguments)])


def objects(result: Result) -> list[dict[str, Any]]:
    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is not JSON")

    return [json.loads(line, parse_constant=refuse) for line in result.stdout.splitlines()]


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    texts = {
        "clean": write_qgc_wpl([HOME, POINT]),
        "rejected": write_qgc_wpl([HOME, LAND]),
        "cleared": write_qgc_wpl([HOME, SPEED]),
        "damaged": write_qgc_wpl([HOME, POINT])[:-20],
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    return {name: tmp_path / name for name in [*texts, "missing"]}


@pytest.mark.parametrize(
    ("names", "code"),
    [
        (["clean"], 0),
        (["cleared"], 3),
        (["rejected"], 1),
        (["damaged"], 2),
        (["missing"], 2),
        (["clean", "cleared"], 3),
        (["cleared", "rejected"], 1),
        (["rejected", "clean"], 1),
        (["clean", "damaged", "rejected"], 2),
    ],
)
@pytest.mark.parametrize("mode", [[], ["--json"]])
def test_the_exit_code_of_several_files_is_the_worst(
    files: dict[str, Path], names: list[str], code: int, mode: list[str]
) -> None:
    assert run(*mode, *[files[name] for name in names]).exit_code == code


def test_json_has_one_object_per_file_with_the_documented_keys(files: dict[str, Path]) -> None:
    result = run("--json", FIELD, files["rejected"], files["cleared"], files["missing"])
    accepted, rejected, cleared, missing = objects(result)
    keys = ["file", "result", "ack", "items", "sent_seqs", "records", "count", "checksum", "findings", "flight"]
    keys += ["path", "assumed"]
    assert list(accepted) == list(rejected) == list(cleared) == keys
    assert (accepted["file"], accepted["result"], accepted["ack"]) == (str(FIELD), "ACCEPTED", "MAV_MISSION_ACCEPTED")
    assert (rejected["result"], rejected["ack"]) == ("REJECTED", "MAV_MISSION_INVALID")
    assert (cleared["result"], cleared["ack"]) == ("CLEARED", "MAV_MISSION_ACCEPTED")
    assert rejected["items"] == rejected["records"] == cleared["items"] == cleared["records"] == []
    assert list(missing) == ["file", "error"]
    assert missing["file"] == str(files["missing"])
    assert "No such file" in missing["error"]
    item_keys = ["seq", "command", "frame", "p1", "p2", "p3", "p4", "lat_e7", "lon_e7", "alt_m"]
    assert {tuple(item) for item in accepted["items"]} == {tuple(item_keys)}
    assert {tuple(finding) for finding in accepted["findings"]} == {
        ("seq", "field", "was", "becomes", "why", "command", "news")
    }
    assert {len(record) for record in accepted["records"]} == {32}
    assert len(accepted["records"]) == len(accepted["items"])


def test_json_stays_json_with_infinite_values(tmp_path: Path) -> None:
    path = tmp_path / "inf.waypoints"
    path.write_text(write_qgc_wpl([HOME, POINT]).replace("\t0\t2\t0\t0\t45.3839", "\tinf\tnan\t0\tnan\t45.3839"))
    (document,) = objects(run("--json", path))
    changes = {finding["field"]: (finding["was"], finding["becomes"]) for finding in document["findings"]}
    assert changes == {"p1": ("inf", 0), "p2": (None, 2)}


def test_a_person_sees_sent_and_stored_values_with_reasons() -> None:
    output = run(FIELD).stdout
    for words in ("naze-field.waypoints", "20->15", "6->5", "5->-", "18.5->18", "DO_CHANGE_SPEED", "400->255"):
        assert words in output
    assert "WP 1: Alt changed from 20 to 15 m (take-off 2..15 m)" in output
    assert "ACCEPTED: 13 of 14 items stored, 1 dropped, values changed: " in output
    assert "does not land; 13 records, checksum " in output or "lands; 13 records, checksum " in output
    assert "Assumed: the craft is at the list's home, mission flight, mission_first = 200" in output


def test_items_keep_their_partners_where_numbers_differ(tmp_path: Path) -> None:
    """INAV drops a TAKEOFF, shows a speed just before its leg, and inserts one where a jump changes the speed."""
    path = tmp_path / "speeds.waypoints"
    commands = [(22, 0.0, 0.0), (178, 1.0, 5.0), (201, 0.0, 0.0), (16, 0.0, 0.0), (178, 1.0, 8.0), (16, 0.0, 0.0)]
    commands += [(16, 0.0, 0.0), (177, 4.0, 1.0)]
    places = [replace(POINT, lat_e7=POINT.lat_e7 + 1000 * seq) for seq in range(8)]  # type: ignore[operator]
    sent = [HOME, *(replace(p, command=c, p1=p1, p2=p2) for p, (c, p1, p2) in zip(places, commands, strict=True))]
    path.write_text(write_qgc_wpl(sent))
    (document,) = objects(run("--json", "--kind", "inav", path))
    assert [item["command"] for item in document["items"]] == [16, 201, 178, 16, 178, 16, 16, 177]
    assert document["sent_seqs"] == [0, 3, 2, 4, 5, 6, 7, 8]
    rows = run("--kind", "inav", path).stdout.splitlines()
    for words in (["1->-", "TAKEOFF"], ["2", "DO_CHANGE_SPEED"], ["3->1", "DO_SET_ROI"], ["4->3", "WAYPOINT"]):
        assert any(row.split()[:2] == words for row in rows), words
    commands = [(16, 0.0, 0.0), (16, 0.0, 0.0), (178, 1.0, 5.0), (16, 0.0, 0.0), (177, 1.0, 1.0), (16, 0.0, 0.0)]
    sent = [HOME, *(replace(p, command=c, p1=p1, p2=p2) for p, (c, p1, p2) in zip(places, commands, strict=False))]
    path.write_text(write_qgc_wpl(sent))
    rows = run("--kind", "inav", path).stdout.splitlines()
    for words in (["-->1", "DO_CHANGE_SPEED"], ["1->2", "WAYPOINT"], ["6->7", "WAYPOINT"]):
        assert any(row.split()[:2] == words for row in rows), words


def test_assumed_values_are_listed(tmp_path: Path, files: dict[str, Path]) -> None:
    saved = tmp_path / "diff.txt"
    saved.write_text("set nav_wp_max_safe_distance = 300\n")
    place = ["--home", "45.3838,8.4733"]
    said = {
        kind: objects(run("--json", "--kind", kind, *options, files["clean"]))[0]["assumed"]
        for kind, options in (("harakiri", []), ("inav", [*place, "--settings", saved]), ("multiwii", place))
    }
    assert said == {
        "harakiri": "the craft is at the list's home, mission flight, mission_first = 200, mission_height = 100",
        "inav": "nav_max_altitude = 0, nav_rth_altitude = 1000",
        "multiwii": "safe_wp_distance = 500, nav_max_altitude = 100",
    }


def test_a_list_without_home_keeps_the_first_item_if_home_is_given(tmp_path: Path) -> None:
    """Item 0 in a relative frame, or a TAKEOFF; the jump's target moves along."""
    place = ["--json", "--kind", "inav", "--home", "45.3838,8.4733"]
    away = [replace(POINT, seq=seq, p2=0.0, lat_e7=453839000 + 2000 * seq) for seq in range(3)]
    back = replace(SPEED, seq=3, command=177, p1=0.0, p2=2.0)
    takeoff = replace(away[0], command=22)
    file = tmp_path / "no_home.waypoints"
    for first, kept in ((away[0], [16, 16, 16, 16, 177]), (takeoff, [16, 16, 16])):
        items = [first, *away[1:], back] if first is away[0] else [first, *away[1:]]
        file.write_text(write_qgc_wpl(items))
        (held,) = objects(run(*place, file))
        assert [item["command"] for item in held["items"]] == kept
        assert (held["items"][0]["lat_e7"], held["items"][0]["frame"]) == (453838000, 0)
    file.write_text(write_qgc_wpl([*away, back]))
    assert objects(run(*place, file))[0]["items"][-1]["p1"] == 1
    output = run(file).stdout
    assert "Home: item 0 became home, not flown to" in output
    assert "If the list has no home, --home LAT,LON adds it" in output


def test_a_person_sees_why_a_list_is_rejected_or_cleared(files: dict[str, Path]) -> None:
    assert "REJECTED: MAV_MISSION_INVALID, Rejected, WP 1: LAND cannot be alone" in run(files["rejected"]).stdout
    assert "CLEARED: MAV_MISSION_ACCEPTED, Mission erased" in run(files["cleared"]).stdout


def test_the_examples_have_the_intended_results() -> None:
    documents = objects(run("--json", FIELD, PLAN, LONG))
    assert [document["result"] for document in documents] == ["ACCEPTED"] * 3
    assert [len(document["items"]) for document in documents] == [13, 10, 146]
    assert len(read_mission_file(LONG.read_bytes(), "long")) == 146
    for document in documents:
        assert any("0d0d0d" in record for record in document["records"]), "no hazard bytes"
        for item, record in zip(document["items"], document["records"], strict=True):
            (held,) = unpack_records(bytes.fromhex(record))
            assert (held.lat_e7, held.lon_e7, held.height_m) == (item["lat_e7"], item["lon_e7"], item["alt_m"])
    assert {item["command"] for item in documents[0]["items"]} >= {16, 18, 19, 20, 21, 22, 201}
    assert {finding["becomes"] for finding in documents[0]["findings"]} >= {"dropped", 15}


@pytest.mark.parametrize(("kind", "stored", "findings"), [("harakiri", 2, 1), ("inav", 3, 0), ("multiwii", 2, 1)])
def test_each_kind_of_flight_controller_has_rules(tmp_path: Path, kind: str, stored: int, findings: int) -> None:
    home, point = (replace(item, p2=2.0 if kind == "harakiri" else 0.0) for item in (HOME, POINT))
    file = tmp_path / "speed.waypoints"
    file.write_text(write_qgc_wpl([home, SPEED, replace(point, seq=2)]))
    (found,) = objects(run("--json", "--kind", kind, file))
    assert (len(found["items"]), len(found["findings"])) == (stored, findings)
    assert len(found["records"][0]) == 2 * (16 if kind == "harakiri" else 20)
    near = tmp_path / "near.txt"
    near.write_text("set nav_wp_max_safe_distance = 0\n")
    settings = ["--settings", near] if kind == "inav" else []
    assert run("--kind", kind, *settings, LONG).exit_code == (1 if kind == "inav" else 0)


def test_an_inavs_saved_settings_decide_about_the_missions(tmp_path: Path) -> None:
    home, point = (replace(item, p2=0.0) for item in (HOME, POINT))
    mission, dump = tmp_path / "mission.waypoints", tmp_path / "dump.txt"
    mission.write_text(write_qgc_wpl([home, replace(point, alt_m=30.0)]))
    dump.write_text("# INAV\nset nav_max_altitude = 2000\n")
    found = run("--kind", "inav", "--settings", dump, mission)
    assert found.exit_code == 1
    assert "WP 1: nav_max_altitude is 20 m: INAV would not climb to 30 m" in found.stdout
    dump.write_text("NVMAXALT,0\nnav_max_altitude,3000\n")
    assert run("--kind", "inav", "--settings", dump, mission).exit_code == 0
    for text, wrong in (
        ("set nav_rth_alt_mode = X\n", "nav_rth_alt_mode cannot be 'X'"),
        ("", "does not contain settings"),
    ):
        dump.write_text(text)
        refused = run("--kind", "inav", "--settings", dump, mission)
        assert refused.exit_code == 2
        assert wrong in refused.stderr
    assert "--settings is for --kind inav" in run("--settings", dump, mission).stderr


def test_home_may_be_given(tmp_path: Path) -> None:
    path = tmp_path / "nowhere.waypoints"
    climb = replace(POINT, command=22, lat_e7=0, lon_e7=0, alt_m=25.0)
    path.write_text(write_qgc_wpl([replace(HOME, lat_e7=0, lon_e7=0), climb, replace(POINT, seq=2)]))
    assert "home is assumed at the first waypoint" in run(path).output
    placed = run("--json", "--home", "45.5,8.25", path)
    (document,) = objects(placed)
    assert (document["items"][0]["lat_e7"], document["items"][0]["lon_e7"]) == (455000000, 82500000)
    assert run("--home", "45.5", path).exit_code == 2
    assert run("--home", "91,0", path).exit_code == 2


def test_the_take_off_limit_is_the_daemons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, config = tmp_path / "high.waypoints", tmp_path / "config.toml"
    climb = replace(POINT, command=22, lat_e7=0, lon_e7=0, alt_m=25.0)
    path.write_text(write_qgc_wpl([HOME, climb, replace(POINT, seq=2)]))
    config.write_text("takeoff_max_m = 25")
    monkeypatch.setenv("NAZE_BRIDGE_CONFIG", str(config))
    assert objects(run("--json", path))[0]["items"][1]["alt_m"] == 25
    config.write_text("takeoff_max_m = 999")
    assert run(path).exit_code == 2
    assert "takeoff_max_m" in run(path).stderr
    monkeypatch.setenv("NAZE_BRIDGE_CONFIG", "")  # as if it were not set
    assert objects(run("--json", path))[0]["items"][1]["alt_m"] == 15


def test_a_list_that_is_too_long_is_refused_without_a_table(tmp_path: Path) -> None:
    path = tmp_path / "long.waypoints"
    path.write_text(write_qgc_wpl([HOME, *(replace(POINT, seq=seq) for seq in range(1, 60000))]))
    output = run(path).stdout
    assert len(output.splitlines()) < 5
    assert "60000 items, but only 146 fit" in output


def test_filled_in_defaults_appear_only_in_the_table(tmp_path: Path) -> None:
    path = tmp_path / "no-radius.waypoints"
    path.write_text(write_qgc_wpl([replace(HOME, p2=0.0), replace(POINT, p2=0.0, alt_m=10.5)]))
    output = run(path).stdout
    assert output.count("0->2") == 2
    assert "Hit Rad" not in output
    assert "WP 1: Alt changed from 10.5 to 10 m" in output


def test_an_unreadable_file_is_reported_in_one_sentence_on_stderr(files: dict[str, Path]) -> None:
    result = run(files["damaged"])
    assert result.stdout == ""
    assert result.stderr.startswith(f"naze-bridge: {files['damaged']}, line 3: ")
    assert result.stderr.count("\n") == 1


def test_a_file_without_home_is_checked_as_if_the_craft_were_at_the_first_waypoint(tmp_path: Path) -> None:
    file = tmp_path / "old.txt"
    point = "{}\t0\t3\t16\t0\t0\t0\t0\t51.477{}\t0.0012\t15\t1\n"
    file.write_text("QGC WPL 120\n" + "".join(point.format(seq, seq) for seq in range(3)))
    for options in ([], ["--home", "51.477,0.001"], ["--kind", "inav"]):
        result = run(file, *options)
        assert result.exit_code == 0, result.output
        assert "4 of 4 items stored" in result.output
        assert ("home is assumed at the first waypoint; `naze-bridge check --home" in result.output) is (
            "--home" not in options
        )
