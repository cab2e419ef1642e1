# SPDX-License-Identifier: GPL-3.0-or-later
"""One daemon per state directory, also after a crash of the previous one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from storage.mission_store import open_store
from storage.state_lock import state_lock
from storage.store_error import StoreError
from tests.support.sample_missions import mission

DAEMON = """
import sys
from pathlib import Path
from tests.support.sample_missions import mission
from storage.mission_store import open_store
from storage.state_lock import state_lock
from storage.store_error import StoreError

directory = Path(sys.argv[1])
try:
    with state_lock(directory), open_store(directory / "missions.db", now=0.0).store as store:
        print(store.add(mission(1)), flush=True)
        sys.stdin.read()
except StoreError as error:
    print(error, flush=True)
"""


def start(directory: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", DAEMON, str(directory)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": f"{Path(__file__).parents[2]}:{Path(__file__).parent}"},
    )


def first_line(daemon: subprocess.Popen[str]) -> str:
    assert daemon.stdout is not None
    return daemon.stdout.readline().strip()


def test_the_second_daemon_gets_the_process_id_of_the_first(tmp_path: Path) -> None:
    directory = tmp_path / "state"
    with start(directory) as first:
        assert first_line(first) == "1"
        with start(directory) as second:
            assert first_line(second) == (
                f"the state directory {directory} is in use by process {first.pid}; "
                f"stop it, or use another directory with --state-dir"
            )
        assert first.poll() is None
        first.kill()
    with start(directory) as third:  # a dead process's lock does not count
        assert first_line(third) == "2"
    with state_lock(directory), open_store(directory / "missions.db", now=0.0).store as store:
        assert [summary.number for summary in store.list(9)] == [2, 1]


def test_only_one_of_many_processes_gets_the_lock(tmp_path: Path) -> None:
    daemons = [start(tmp_path) for _ in range(5)]
    lines = [first_line(daemon) for daemon in daemons]
    for daemon in daemons:
        daemon.communicate()
    assert sum(line == "1" for line in lines) == 1
    assert sum("is in use by" in line for line in lines) == 4


def test_the_lock_can_be_released_and_taken_again(tmp_path: Path) -> None:
    for _ in range(2):
        in_use = pytest.raises(StoreError, match=f"in use by process {os.getpid()}")
        with state_lock(tmp_path), in_use, state_lock(tmp_path):
            pass


def test_a_file_in_place_of_the_directory_is_reported(tmp_path: Path) -> None:
    (tmp_path / "state").touch()
    unusable = pytest.raises(
        StoreError, match=r"cannot use the state directory .*/state: .*use another with --state-dir"
    )
    with unusable, state_lock(tmp_path / "state"):
        pass


def test_without_the_lock_two_writers_take_turns(tmp_path: Path) -> None:
    """A store shared despite the rule still loses nothing."""
    path = tmp_path / "missions.db"
    with open_store(path, now=0.0).store as one, open_store(path, now=0.0).store as other:
        numbers = [store.add(mission(tag)) for tag in range(10) for store in (one, other)]
        assert numbers == list(range(1, 21))
        assert one.list(99) == other.list(99)
