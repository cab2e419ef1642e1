"""`push`, `pull`, `clear` and `status` as a person and as a script use them, against a running daemon."""

import os
import stat
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from benches import Starter
from plan import plain_plan
from programs import Daemon, run_naze_bridge

from protocols.mission_file import read_mission_file


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A daemon on the simulated Naze within it."""
    with ExitStack() as stack:
        daemon = Starter(tmp_path_factory.mktemp("cli"), stack).daemon("sim:")
        daemon.wait()
        yield daemon


def ask(daemon: Daemon, *arguments: str | Path, **options: object) -> subprocess.CompletedProcess[str]:
    return run_naze_bridge(*arguments, "--state-dir", daemon.state_dir, **options)


def assert_one_sentence(ended: subprocess.CompletedProcess[str], code: int, *parts: str) -> None:
    assert ended.returncode == code, ended
    assert ended.stdout == ""
    (sentence,) = ended.stderr.splitlines()
    assert sentence.startswith("naze-bridge: ")
    assert not [part for part in parts if part not in sentence], sentence


# -- pull into a file ----------------------------------------------------------------------------------------


def test_pull_writes_a_file_that_push_takes(daemon: Daemon, tmp_path: Path) -> None:
    daemon.push(plain_plan(5))
    file = tmp_path / "held.waypoints"
    file.write_text("what was there before")
    assert ask(daemon, "pull", file).returncode == 0
    assert len(read_mission_file(file.read_bytes(), "held")) == 5
    assert os.listdir(tmp_path) == [file.name]
    assert ask(daemon, "push", file).returncode == 0


def test_pull_through_a_link_replaces_what_it_leads_to(daemon: Daemon, tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    link.symlink_to(target)
    for _ in ("a new file", "the same again"):
        assert ask(daemon, "pull", link).returncode == 0
        assert link.readlink() == target
        assert target.read_text().startswith("QGC WPL 110")
        target.write_text("")


def a_pipe(path: Path) -> None:
    os.mkfifo(path)


def a_link_to_a_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


def a_directory(path: Path) -> None:
    path.mkdir()


@pytest.mark.parametrize("make", [a_pipe, a_link_to_a_pipe, a_directory])
def test_pull_replaces_nothing_but_files(daemon: Daemon, tmp_path: Path, make: object) -> None:
    assert callable(make)
    path = tmp_path / "in the way"
    make(path)
    kind = stat.S_IFMT(path.stat().st_mode)
    assert_one_sentence(ask(daemon, "pull", path), 1, str(path), "no regular file")
    assert stat.S_IFMT(path.stat().st_mode) == kind


def test_pull_into_a_link_that_leads_to_itself(daemon: Daemon, tmp_path: Path) -> None:
    path = tmp_path / "loop"
    path.symlink_to(path)
    assert_one_sentence(ask(daemon, "pull", path), 1, str(path), "loop")
    assert path.is_symlink()


def test_pull_into_a_folder_that_is_not_there(daemon: Daemon, tmp_path: Path) -> None:
    assert_one_sentence(ask(daemon, "pull", tmp_path / "none" / "held"), 1, "no such file or directory")
