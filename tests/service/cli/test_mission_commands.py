# SPDX-License-Identifier: GPL-3.0-or-later
"""`push`, `pull`, `clear` and `status` as used by a person and by a script, with a running daemon."""

import errno
import json
import math
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from protocols.mission_file import MissionFileError, read_mission_file
from protocols.mission_item import Command
from terminal.files import write_file
from tests.support.plan import HOME, PlanRow, judge, plain_plan, plan_text, records_of, waypoint
from tests.support.programs import Daemon, run_naze_bridge


def ask(daemon: Daemon, *arguments: str | Path, **options: object) -> subprocess.CompletedProcess[str]:
    return run_naze_bridge(*arguments, "--state-dir", daemon.state_dir, **options)


def assert_one_sentence(ended: subprocess.CompletedProcess[str], code: int, *parts: str) -> None:
    assert ended.returncode == code, ended
    assert not ended.stdout
    (sentence,) = ended.stderr.splitlines()
    assert sentence.startswith("naze-bridge: ")
    assert not [part for part in parts if part not in sentence], sentence


def strict(text: str) -> Any:
    """Read JSON strictly, without NaN."""

    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is not JSON")

    return json.loads(text, parse_constant=refuse)


def write_plan(path: Path, plan: list[PlanRow]) -> Path:
    path.write_text(plan_text(plan))
    return path


# -- output -----------------------------------------------------------------------------------------


def test_a_pushed_mission_is_pulled_unchanged(daemon: Daemon, tmp_path: Path) -> None:
    plan = plain_plan(7, start=20)
    pushed = ask(daemon, "push", write_plan(tmp_path / "plan", plan))
    assert pushed.returncode == 0
    assert "ACCEPTED: 7 of 7 stored: " in pushed.stdout
    assert daemon.pull()["records"] == records_of(judge(plan))
    pulled = ask(daemon, "pull")
    assert pulled.stdout.endswith(f"7 records, checksum {daemon.pull()['checksum']}\n")
    assert "45.3847523" in pulled.stdout
    assert ask(daemon, "clear").stdout == "ACCEPTED: Mission on the flight controller cleared\n"
    assert ask(daemon, "pull").stdout == "0 records, checksum 00000000\n"
    assert ask(daemon, "clear").stdout == "ACCEPTED: No mission to clear on the flight controller\n"


def test_a_refusal_is_reported_with_exit_status_1(daemon: Daemon, tmp_path: Path) -> None:
    refused = ask(daemon, "push", write_plan(tmp_path / "plan", [HOME, PlanRow(Command.NAV_LAND), waypoint(1)]))
    assert refused.returncode == 1
    assert refused.stdout.splitlines()[-1] == "INVALID: Rejected, WP 1: LAND must be last"


def test_a_list_that_is_too_long_is_refused_without_a_table(daemon: Daemon, tmp_path: Path) -> None:
    refused = ask(daemon, "push", write_plan(tmp_path / "long", plain_plan(500)))
    assert refused.returncode == 1
    assert refused.stdout == "NO_SPACE: Mission rejected: 500 items, but only 146 fit\n"
    for count in (501, 5000):
        refused = ask(daemon, "push", write_plan(tmp_path / "longer", plain_plan(count)))
        assert refused.returncode == 1
        assert "this mission is longer than any flight controller stores" in refused.stderr


def test_unset_values_are_null_in_json(daemon: Daemon, tmp_path: Path) -> None:
    plan = [replace(row, p1=math.nan, p4=math.nan) for row in plain_plan(4, start=30)]
    file = write_plan(tmp_path / "plan", plan)
    file.write_text(file.read_text().replace("\tNaN\t45", "\tinf\t45"))
    delivery = strict(ask(daemon, "push", file, "--json").stdout)
    assert [(item["p1"], item["p4"]) for item in delivery["sent"]] == [(None, "inf")] * 4
    assert [(item["p1"], item["p4"]) for item in delivery["stored"]] == [(0, 0)] * 4
    number = delivery["mission"]
    shown = strict(ask(daemon, "missions", "show", str(number), "--json").stdout)
    assert shown["received"]["items"] == delivery["sent"]
    # Unset values stay unset.
    again = strict(ask(daemon, "missions", "restore", str(number), "--json").stdout)
    assert again["sent"] == delivery["sent"]


# -- pull into a file ----------------------------------------------------------------------------------------


def test_pull_writes_a_file_that_push_accepts(daemon: Daemon, tmp_path: Path) -> None:
    daemon.push(plain_plan(5))
    file = tmp_path / "held.waypoints"
    file.write_text("what was there before")
    assert ask(daemon, "pull", file).returncode == 0
    assert len(read_mission_file(file.read_bytes(), "held")) == 5
    assert os.listdir(tmp_path) == [file.name]
    assert ask(daemon, "push", file).returncode == 0


def test_pull_through_a_link_replaces_the_target(daemon: Daemon, tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    link.symlink_to(target)
    for _ in ("a new file", "the same again"):
        assert ask(daemon, "pull", link).returncode == 0
        assert link.readlink() == target
        assert target.read_text().startswith("QGC WPL 110")
        target.write_text("")


def test_pull_replaces_only_files(daemon: Daemon, tmp_path: Path) -> None:
    pipe, path = tmp_path / "pipe", tmp_path / "in the way"
    os.mkfifo(pipe)
    path.symlink_to(pipe)
    assert_one_sentence(ask(daemon, "pull", path), 1, str(path), "not a regular file")
    assert_one_sentence(ask(daemon, "pull", tmp_path / "none" / "held"), 1, "No such file or directory")
    assert pipe.is_fifo()


def test_a_full_disk_is_named_with_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(MissionFileError, match="No space left on device; delete other files there"):
        write_file(tmp_path / "held.waypoints", "text", MissionFileError)
    assert list(tmp_path.iterdir()) == []


def test_pull_into_standard_output_is_a_mission_file(daemon: Daemon) -> None:
    daemon.push(plain_plan(6))
    pulled = ask(daemon, "pull", "-")
    assert len(read_mission_file(pulled.stdout.encode(), "-")) == 6
    assert pulled.stderr == f"6 records, checksum {daemon.pull()['checksum']}\n"
    assert ask(daemon, "pull", "-", "--json").returncode == 2


def test_a_checksum_looks_the_same_everywhere(daemon: Daemon, tmp_path: Path) -> None:
    number = strict(ask(daemon, "push", write_plan(tmp_path / "plan", plain_plan(5)), "--json").stdout)["mission"]
    assert {
        strict(ask(daemon, "pull", "--json").stdout)["checksum"],
        strict(ask(daemon, "status", "--json").stdout)["mission_checksum"],
        strict(ask(daemon, "missions", "list", "--limit", "1", "--json").stdout)[0]["checksum"],
        strict(ask(daemon, "missions", "show", str(number), "--json").stdout)["received"]["checksum"],
    } == {daemon.pull()["checksum"]}


def test_tables_fit_without_trailing_spaces(daemon: Daemon, tmp_path: Path) -> None:
    far = replace(waypoint(1), lat=-45.3838, lng=-178.4733, alt=1000.5, p1=400.5)
    plan = [HOME, replace(far, command=Command.NAV_LOITER_TIME), far, PlanRow(Command.NAV_RETURN_TO_LAUNCH, alt=15)]
    file = write_plan(tmp_path / "plan", plan)
    number = strict(ask(daemon, "push", file, "--json").stdout)["mission"]
    for arguments in (["push", file], ["pull"], ["missions", "show", str(number)], ["missions", "list"]):
        lines = ask(daemon, *arguments).stdout.splitlines()
        assert len(lines) > 2, arguments
        assert [line for line in lines if len(line) > 80 or line != line.rstrip()] == []
        if arguments[0] in ("push", "pull"):
            assert sum("RETURN_TO_LAUNCH" in line for line in lines) == 1
            assert sum("1000" in line and "-178.4733000" in line for line in lines) == 2
