# SPDX-License-Identifier: GPL-3.0-or-later
"""If nothing can be stored, one sentence gives the reason and earlier missions are kept."""

import sqlite3
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from storage.mission_store import open_store
from storage.store_error import StoreError
from tests.support.sample_missions import intact, mission, received


def run(script: str, *arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=cwd,
        env={"PYTHONPATH": f"{Path(__file__).parents[2]}:{Path(__file__).parent}"},
        capture_output=True,
        text=True,
        check=True,
    )


# A limit on file size stands in for a full disk.
FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from tests.support.sample_missions import mission
from storage.mission_store import open_store
from storage.store_error import StoreError

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
_, most = resource.getrlimit(resource.RLIMIT_FSIZE)
store = open_store(Path(sys.argv[1]), now=0.0).store
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), most))
numbers = []
try:
    while True:
        numbers.append(store.add(mission(len(numbers) + 1, items=100)))
except StoreError as error:
    print(error)
try:
    while True:
        store.conclude(numbers[0], "VERIFIED", "", 1.0)
except StoreError as error:
    print(error)
print(len(store.list(10_000)))
resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
store.conclude(store.add(mission(0)), "VERIFIED", "after", 1.0)
print(len(numbers))
"""


@pytest.mark.parametrize("limit", [150_000, 400_001])
def test_a_full_disk_is_reported_and_keeps_earlier_missions(tmp_path: Path, limit: int) -> None:
    path = tmp_path / "missions.db"
    add_error, conclude_error, listed, added = run(FULL_DISK, str(path), str(limit)).stdout.splitlines()
    assert add_error.startswith(f"cannot store the mission in {path}: the disk is full")
    assert conclude_error.startswith(f"cannot store the outcome of mission 1 in {path}: the disk is full")
    count = int(added)
    assert count > 2
    assert int(listed) == count
    with intact(path) as store:
        for number in range(1, count + 1):
            assert received(store, number) == mission(number, items=100)
        last = store.list(1)[0]
        assert (last.outcome, last.detail) == ("VERIFIED", "after")


# Root may write anywhere, so the test runs as the user `nobody`.
AS_NOBODY = """
import os, sys
from pathlib import Path
from storage.mission_store import open_store
from storage.store_error import StoreError
from storage.state_lock import state_lock

if os.geteuid() == 0:
    os.setgid(65534)
    os.setuid(65534)
try:
    if sys.argv[1] == "lock":
        state_lock(Path(".")).__enter__()
    else:
        open_store(Path("missions.db"), now=0.0).store.close()
except StoreError as error:
    print(error)
"""


@pytest.mark.parametrize("with_store", [False, True])
def test_a_directory_without_write_permission_is_reported(with_store: bool) -> None:
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        if with_store:
            with open_store(directory / "missions.db", now=0.0).store as store:
                store.add(mission(1))
            (directory / "missions.db").chmod(0o444)
        directory.chmod(0o555)
        output = run(AS_NOBODY, "store", cwd=directory).stdout
        lock_said = run(AS_NOBODY, "lock", cwd=directory).stdout
        directory.chmod(0o755)
    assert output.startswith("cannot open the mission store missions.db: it ")
    assert "check" in output
    assert lock_said.startswith("cannot use the state directory .: Permission denied")


@pytest.mark.parametrize("path", ["/proc/naze-bridge/missions.db", "/dev/null/missions.db"])
def test_a_directory_that_cannot_be_created_is_reported(path: str) -> None:
    with pytest.raises(StoreError, match=f"cannot open the mission store {path}: its directory cannot be created"):
        open_store(Path(path), now=0.0)


def test_a_directory_in_place_of_the_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"cannot open the mission store .*: it cannot be opened"):
        open_store(tmp_path, now=0.0)


def test_a_file_locked_by_another_program_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "missions.db"
    with open_store(path, now=0.0).store as store:
        other = sqlite3.connect(path, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StoreError, match=r"cannot store the mission in .*: another process has locked it"):
            store.add(mission(1))
        assert store.list(9) == []  # reading continues
        with pytest.raises(StoreError, match="another process has locked it"):
            open_store(path, now=0.0)
        other.execute("ROLLBACK")
        other.close()
        assert store.add(mission(1)) == 1
