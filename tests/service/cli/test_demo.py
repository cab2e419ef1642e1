# SPDX-License-Identifier: GPL-3.0-or-later

import os
import shutil
import signal
import subprocess
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.programs import NAZE_BRIDGE, Program, free_port, run_naze_bridge, until

REPOSITORY = Path(__file__).parents[3]
TEMPORARY = "naze-bridge-demo-"


@pytest.fixture
def folder() -> Iterator[Path]:
    """A short path, because a Unix socket's path is limited to 107 characters."""
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


@pytest.fixture
def demo(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Program]:
    """A running demonstration with its temporary files in `folder`."""
    monkeypatch.setenv("TMPDIR", str(folder))
    with ExitStack() as stack:
        program = Program(tmp_path / "printed", "demo", "--port", str(free_port()))
        # Not SIGKILL, which would leave its daemon running.
        stack.callback(program.end)
        until(
            lambda: "keeps running" in program.printed or not program.is_alive,
            "the end of the demonstration",
        )
        assert program.is_alive, program.printed
        yield program


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_the_daemon_and_files_are_removed_at_the_end(demo: Program, folder: Path, number: signal.Signals) -> None:
    (state,) = folder.glob(f"{TEMPORARY}*")
    daemon = int((state / "lock").read_text())
    os.kill(daemon, 0)
    assert demo.end(number) == (0 if number is signal.SIGINT else 128 + number)
    assert not list(folder.glob(f"{TEMPORARY}*"))
    with pytest.raises(ProcessLookupError):
        os.kill(daemon, 0)
    assert "Traceback" not in demo.printed


def test_an_installation_has_the_example(tmp_path: Path) -> None:
    """The packages of the wheel, without the rest of the repository."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    for package in project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        shutil.copytree(REPOSITORY / package, tmp_path / package)
    ended = subprocess.run(
        [*NAZE_BRIDGE, "demo", "--once", "--port", str(free_port())],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended
    assert "Sent 14 items; the flight controller holds 13" in ended.stdout


def test_a_missing_file_is_reported_in_one_sentence(tmp_path: Path) -> None:
    ended = run_naze_bridge("demo", "--once", tmp_path / "none")
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"naze-bridge: {tmp_path / 'none'}: No such file")
