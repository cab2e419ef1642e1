# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a fleet: differences, a dry run, and a restore that stops at the first failure if staged."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.fleet_bench import Fleet, running_fleet
from tests.support.programs import run_naze_bridge, until

NAMES = ("kite", "owl", "swift")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with running_fleet(tmp_path_factory.mktemp("fleet"), *NAMES) as fleet:
        until(lambda: all(settings(fleet, name, "list").returncode == 0 for name in NAMES), "the settings")
        yield fleet


def settings(fleet: Fleet, name: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return run_naze_bridge("settings", *words, "--state-dir", fleet.daemons[name].state_dir)


def value(fleet: Fleet, name: str, setting: str) -> str:
    return settings(fleet, name, "get", setting).stdout.strip()


def test_the_vehicle_that_differs_is_named(fleet: Fleet) -> None:
    same = fleet.ask("settings", "diff")
    assert (same.returncode, same.stdout) == (0, "0 settings differ between 3 vehicles\n"), same
    assert settings(fleet, "owl", "set", "p_yaw", "77").returncode == 0
    differ = fleet.ask("settings", "diff")
    assert differ.returncode == 1
    assert differ.stdout.split()[:6] == ["Setting", "Value", "Vehicles", "p_yaw", "60", "kite,"]
    found = json.loads(fleet.ask("settings", "diff", "--json").stdout)
    variants = [{"value": 60.0, "vehicles": ["kite", "swift"]}, {"value": 77.0, "vehicles": ["owl"]}]
    assert found == {"settings": {"p_yaw": variants}, "errors": {}}
    assert fleet.ask("settings", "diff", "--vehicle", "kite", "--vehicle", "swift").returncode == 0
    settings(fleet, "owl", "set", "p_yaw", "60")


def test_a_file_is_tried_and_then_restored_on_all(fleet: Fleet, tmp_path: Path) -> None:
    file = tmp_path / "tuned.param"
    assert settings(fleet, "kite", "backup", file).returncode == 0
    file.write_text(file.read_text().replace("\nP_ROLL,35\n", "\nP_ROLL,48\n"))
    tried = fleet.ask("settings", "restore", file, "--all", "--dry-run")
    assert tried.returncode == 0, tried
    assert tried.stdout.endswith("3 of 3 vehicles could take all settings; nothing was written\n")
    assert value(fleet, "swift", "p_roll") == "35"
    restored = fleet.ask("settings", "restore", file, "--all", "--staged")
    assert restored.returncode == 0, restored
    assert restored.stdout.count("1 setting restored, saved and verified") == 3
    assert restored.stdout.endswith("3 of 3 vehicles have saved these settings, verified\n")
    assert [value(fleet, name, "p_roll") for name in NAMES] == ["48", "48", "48"]
    history = settings(fleet, "swift", "history", "--json")
    assert [line["occasion"] for line in json.loads(history.stdout)][:2] == ["saved", "connected"]


def test_a_staged_restore_stops_at_the_first_failure(fleet: Fleet, tmp_path: Path) -> None:
    file = tmp_path / "bad.param"
    file.write_text("p_pitch,44\ngbl_flg,9\n")
    tried = fleet.ask("settings", "restore", file, "--all", "--dry-run")
    assert (tried.returncode, tried.stdout.count("cannot be set: gbl_flg")) == (1, 3), tried
    restored = fleet.ask("settings", "restore", file, "--all", "--staged", "--json")
    assert restored.returncode == 1
    errors = {each["vehicle"]: each["error"] for each in json.loads(restored.stdout)["vehicles"]}
    assert "1 left out" in errors["kite"]
    assert errors["owl"] == errors["swift"] == "kite had failed"
    assert value(fleet, "owl", "p_pitch") == "35"


def test_an_unreadable_file_is_reported_in_one_sentence(fleet: Fleet, tmp_path: Path) -> None:
    file = tmp_path / "bad.param"
    file.write_text("p_pitch;44\n")
    ended = fleet.ask("settings", "restore", file, "--all")
    assert ended.returncode == 2
    assert "line 1" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
