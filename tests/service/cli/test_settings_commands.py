# SPDX-License-Identifier: GPL-3.0-or-later
"""`settings`: the flight controller's settings on the command line, through a daemon and without one."""

import json
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

import pytest

from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.benches import Starter
from tests.support.programs import Daemon, run_naze_bridge, until


def settings(daemon: Daemon, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return run_naze_bridge("settings", *words, "--state-dir", daemon.state_dir)


def value(daemon: Daemon, name: str) -> str:
    return settings(daemon, "get", name).stdout.strip()


def history(daemon: Daemon) -> list[dict[str, object]]:
    lines: list[dict[str, object]] = json.loads(settings(daemon, "history", "--json").stdout)
    return lines


@pytest.fixture
def tuned(start: Starter) -> Daemon:
    """A daemon on a simulated Naze whose settings have been read and backed up."""
    daemon = start.daemon("sim:")
    daemon.wait()
    until(lambda: history(daemon), "the first backup")
    return daemon


@pytest.fixture
def unchanged(daemon: Daemon) -> Daemon:
    """The same for tests that change nothing."""
    until(lambda: history(daemon), "the first backup")
    return daemon


def test_settings_are_listed_changed_and_saved(tuned: Daemon) -> None:
    listed = settings(tuned, "list").stdout
    assert "p_roll" in listed
    held = json.loads(settings(tuned, "list", "--json").stdout)
    assert held["is_complete"]
    assert {"name", "value", "minimum", "maximum", "unit", "fixed"} <= held["settings"][0].keys()
    changed = settings(tuned, "set", "p_roll", "44")
    assert changed.stdout == "p_roll changed from 35 to 44; not saved yet\n"
    assert value(tuned, "P_ROLL") == "44"
    assert settings(tuned, "set", "p_roll", "44").stdout == "p_roll is 44 already\n"
    assert len(history(tuned)) == 1
    assert settings(tuned, "save").stdout == "Settings saved\n"
    until(lambda: len(history(tuned)) == 2, "a backup of the saved settings")
    newest = history(tuned)[0]
    assert (newest["occasion"], newest["changed_count"]) == ("saved", 1)
    negative = settings(tuned, "set", "rc_trm_rll", "-5")
    assert negative.returncode == 0, negative


def test_an_unsettable_name_is_reported_in_one_sentence(unchanged: Daemon) -> None:
    assert_one_sentence(settings(unchanged, "set", "p_roll", "999"), 1, "p_roll stays 35")
    assert_one_sentence(settings(unchanged, "set", "p_roll", "high"), 1, "p_roll cannot be high: it must be 1..200")
    assert_one_sentence(settings(unchanged, "set", "gbl_flg", "5"), 1, "gbl_flg stays")
    assert_one_sentence(settings(unchanged, "get", "p_rol"), 1, "has no setting p_rol: did you mean p_roll?")
    assert_one_sentence(settings(unchanged, "set", "p_roll", "inf"), 1, "p_roll stays 35")
    assert len(history(unchanged)) == 1


def test_modes_are_listed_with_channel_and_pulses(start: Starter) -> None:
    inav = start.bench("--kind", "inav").daemon
    until(lambda: history(inav), "the first backup")
    assert settings(inav, "set", "MODE_ANGLE", "AUX1 1300-1700; AUX2 900-1200").returncode == 0
    rows = [line.split() for line in settings(inav, "modes").stdout.splitlines()]
    assert rows[0] == ["Mode", "Channel", "From", "To"]
    ranges = [["MODE_ANGLE", "AUX1", "1300", "1700"], ["MODE_ANGLE", "AUX2", "900", "1200"]]
    assert [row for row in rows if row[0] == "MODE_ANGLE"] == ranges


def test_a_board_without_mode_ranges_says_so(unchanged: Daemon) -> None:
    assert_one_sentence(settings(unchanged, "modes"), 1, "has boxes instead of mode ranges")


def test_a_file_is_backed_up_compared_and_restored(tuned: Daemon, tmp_path: Path) -> None:
    file = tmp_path / "before.param"
    assert settings(tuned, "backup", file).returncode == 0
    assert file.read_text().startswith("# board: Harakiri")
    assert settings(tuned, "diff", file).stdout == "no difference\n"
    for name, new in (("p_roll", "44"), ("snr_cf", "0.1")):
        settings(tuned, "set", name, new)
    settings(tuned, "save")
    different = settings(tuned, "diff", file, "--json")
    assert different.returncode == 1
    names = [change["name"] for change in json.loads(different.stdout)["changes"]]
    assert sorted(names) == ["p_roll", "snr_cf"]
    tried = settings(tuned, "restore", file, "--dry-run")
    assert (tried.returncode, value(tuned, "p_roll")) == (1, "44")
    restored = settings(tuned, "restore", file)
    assert restored.returncode == 0, restored
    assert restored.stdout.endswith("2 settings restored, saved and verified\n")
    assert settings(tuned, "diff", file).returncode == 0
    again = settings(tuned, "restore", file)
    assert (again.returncode, "has these settings" in again.stdout) == (0, True)
    until(lambda: [line["occasion"] for line in history(tuned)] == ["saved", "saved", "connected"], "the backups")


def test_a_dump_is_compared_and_restored_and_the_other_lines_are_listed(tuned: Daemon, tmp_path: Path) -> None:
    file = tmp_path / "dump.txt"
    written = settings(tuned, "backup", file)
    assert written.returncode == 0, written
    assert "\nset p_roll = 35\n" in file.read_text()
    assert settings(tuned, "diff", file).stdout == "no difference\n"
    file.write_text("FW: TestCode3\nfeature GPS\nP_ROLL = 44\n")
    different = settings(tuned, "diff", file, "--json")
    assert json.loads(different.stdout)["changes"] == [{"name": "p_roll", "left": 44.0, "right": 35}]
    assert "200 settings are not in" in different.stderr
    restored = settings(tuned, "restore", file)
    assert restored.returncode == 0, restored
    assert "lines that are not settings: 1 (FW:), 2 (feature)" in restored.stderr
    assert value(tuned, "p_roll") == "44"
    assert settings(tuned, "diff", file).stdout == "no difference\n"


def test_a_backup_is_compared_and_restored_by_the_number(tuned: Daemon) -> None:
    settings(tuned, "set", "p_roll", "44")
    settings(tuned, "save")
    until(lambda: len(history(tuned)) == 2, "the second backup")
    assert settings(tuned, "diff", "1", "2").stdout.split() == ["Name", "1", "2", "p_roll", "35", "44"]
    assert settings(tuned, "restore", "1").returncode == 0
    assert value(tuned, "p_roll") == "35"
    assert_one_sentence(settings(tuned, "restore", "99"), 1, "there is no backup 99")


def test_settings_that_cannot_be_restored_are_named(tuned: Daemon, tmp_path: Path) -> None:
    file = tmp_path / "other.param"
    file.write_text("p_roll,44\nesc_moff,1100\ngbl_flg,7\np_pitch,999\nWPNAV_SPEED,5\n")
    restored = settings(tuned, "restore", file)
    assert restored.returncode == 1
    assert restored.stdout.endswith("1 setting restored, saved and verified, 4 left out\n"), restored
    left_out = "".join(line for line in restored.stdout.splitlines() if line.startswith("Left out: "))
    for name in ("esc_moff", "gbl_flg", "p_pitch", "WPNAV_SPEED"):
        assert name in left_out
    file.write_text("# board: INAV 8.0.1\np_roll,50\n")
    assert_one_sentence(settings(tuned, "restore", file), 1, "These settings are from INAV 8.0.1")
    assert value(tuned, "p_roll") == "44"


def test_an_unreadable_file_is_reported_in_one_sentence(unchanged: Daemon, tmp_path: Path) -> None:
    file = tmp_path / "bad.param"
    assert_one_sentence(settings(unchanged, "restore", file), 2, "No such file")
    file.write_text("p_roll;44\n")
    assert_one_sentence(settings(unchanged, "restore", file), 2, "line 1")
    assert_one_sentence(settings(unchanged, "backup", tmp_path / "none" / "x"), 1, "No such file")


def test_a_backup_without_a_daemon(tmp_path: Path) -> None:
    file = tmp_path / "direct.param"
    direct = run_naze_bridge("settings", "backup", file, "--fc", "sim:")
    assert direct.returncode == 0, direct
    assert "\nP_ROLL,35\n" in file.read_text()


def test_an_armed_board_is_listed_but_not_changed(start: Starter, tmp_path: Path) -> None:
    board = start.board()
    daemon = start.daemon(board.fc)
    daemon.wait()
    until(lambda: history(daemon), "the first backup")
    file = tmp_path / "x.param"
    file.write_text("p_roll,44\n")
    board.set("armed 1")
    until(lambda: daemon.ask({"do": "status"})["armed"], "the armed craft")
    listed = settings(daemon, "list")
    assert "p_roll" in listed.stdout
    assert "as last read" in listed.stderr
    for words in (("set", "p_roll", "44"), ("save",), ("restore", file)):
        refused = settings(daemon, *words)
        assert refused.returncode == 1, words
        assert "Armed: disarm to change settings" in refused.stderr
    board.set("armed 0")
    until(lambda: settings(daemon, "set", "p_roll", "44").returncode == 0, "the disarmed board")


def test_a_store_that_fails_does_not_prevent_a_restore(start: Starter, tmp_path: Path) -> None:
    """Its file is locked by another program, and the log says so."""
    daemon = start.daemon("sim:")
    daemon.wait()
    until(lambda: history(daemon), "the first backup")
    file = tmp_path / "x.param"
    file.write_text("p_roll,44\n")
    with closing(sqlite3.connect(daemon.state_dir / "missions.db", isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        restored = settings(daemon, "restore", file)
        assert restored.returncode == 0, restored
        until(lambda: daemon.has_logged("store.failed"), "the failure in the log")
    assert value(daemon, "p_roll") == "44"
