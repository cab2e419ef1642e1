# SPDX-License-Identifier: GPL-3.0-or-later
"""The enroll command: rules of its own for each name, a full router."""

import json
from pathlib import Path

from tests.support.programs import run_naze_bridge


def test_a_vehicle_with_any_name_has_a_rule_of_its_own(tmp_path: Path) -> None:
    for name in ("asked", "answered", "everything"):
        assert run_naze_bridge("fleet", "enroll", name, "--folder", tmp_path).returncode == 0
    rules = [rule["id"] for rule in json.loads((tmp_path / "router.json5").read_text())["access_control"]["rules"]]
    assert len(set(rules)) == len(rules)


def has_members(folder: Path, **members: dict[str, str]) -> None:
    (folder / "members.json").write_text(json.dumps({"router": None, "members": members}))


def test_each_vehicle_gets_a_system_id_that_no_other_has(tmp_path: Path) -> None:
    """Also those that were members before; the id of an expelled member is free again."""

    def enroll(name: str, *more: str) -> str:
        return run_naze_bridge("fleet", "enroll", name, "--folder", tmp_path, *more).stdout

    has_members(tmp_path, anna={"role": "pilot"}, kite={"role": "vehicle"})
    assert "\nsysid = 2\n\n[zenoh]\n" in enroll("owl")
    assert "\nsysid = 1\n" in enroll("kite")
    assert "sysid" not in enroll("anna", "--role", "pilot")
    assert "\nsysid = 3\n" in enroll("crow")
    run_naze_bridge("fleet", "expel", "owl", "--folder", tmp_path)
    assert "\nsysid = 2\n" in enroll("swift")
    members = tmp_path / "members.json"
    members.write_text(members.read_text().replace('"sysid": 3', '"sysid": 2'))
    same = run_naze_bridge("fleet", "enroll", "lark", "--folder", tmp_path).stderr
    assert "both have system id 2" in same


def test_beyond_250_vehicles_there_is_no_system_id(tmp_path: Path) -> None:
    has_members(tmp_path, **{f"kite-{number}": {"role": "vehicle"} for number in range(250)})
    enrolled = run_naze_bridge("fleet", "enroll", "owl", "--folder", tmp_path)
    assert (enrolled.returncode, "system ids are in use" in enrolled.stdout) == (0, True)
