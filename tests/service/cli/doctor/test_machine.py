# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine: clock, disk, state directory, store."""

import os
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

from service.cli.doctor.machine import check_clock, check_database, check_power
from storage.mission_store import open_store
from tests.support.doctor import assert_note, assert_ok, assert_problem
from tests.support.faulty_machine import FaultyMachine

NOW = datetime(2026, 11, 21, 12, tzinfo=UTC)


def test_a_clock_kept_by_another_program_is_fine(pi: FaultyMachine) -> None:
    assert_ok(check_clock(pi, NOW), "set by the network")
    pi.path("/run/systemd/timesync/synchronized").unlink()
    pi.runs(12, "/usr/sbin/chronyd")
    assert_ok(check_clock(pi, NOW), "kept by chronyd")


def test_a_file_that_is_not_a_database_is_a_problem(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    assert_ok(check_database(tmp_path), "none stored yet")
    open_store(path, 0).store.close()
    assert_ok(check_database(tmp_path), "0 stored")
    path.write_bytes(b"rubbish" * 1000)
    assert_problem(check_database(tmp_path), "is damaged: file is not a database", "restart the bridge")


def test_a_store_of_a_compromised_service_is_harmless(tmp_path: Path) -> None:
    """Its file names are part of a command for root, its contents of texts on root's terminal."""
    (tmp_path / "missions.db.corrupt-$(reboot)1").touch()
    assert_ok(check_database(tmp_path), "none stored yet")
    path = tmp_path / "missions.db"
    os.mkfifo(path)
    assert_problem(check_database(tmp_path), "not a regular file", "move it away")
    path.unlink()
    path.symlink_to("/etc/passwd")
    assert_problem(check_database(tmp_path), "not a regular file", "move it away")
    path.unlink()
    with closing(sqlite3.connect(path)) as database:
        database.execute('CREATE TABLE "a\x1b[2J" (a NOT NULL)')
        database.execute('CREATE VIEW missions AS SELECT 1 FROM "b\x1b[2J"')
    (found,) = check_database(tmp_path)
    assert_problem(found, "is damaged: ", "restart the bridge")
    assert found.found.isprintable()


def test_undervoltage_now_and_since_the_start() -> None:
    assert_problem(check_power(lambda *_: "throttled=0x50005\n"), "is too low", "5.1 V")
    assert_note(check_power(lambda *_: "throttled=0x50000\n"), "was too low since the start")
    assert_ok(check_power(lambda *_: "throttled=0x0\n"), "no undervoltage since the start")


def test_other_machines_skip_this_check() -> None:
    assert check_power(lambda *_: "") is None
    assert check_power(lambda *_: "VCHI initialization failed") is None
