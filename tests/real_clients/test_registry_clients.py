# SPDX-License-Identifier: GPL-3.0-or-later
"""Clients from package registries that the tests' own environment cannot hold: gomavlib (Go), and MAVSDK 3 beside 4."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support.benches import Bench, Starter
from tests.support.programs import free_port

_HERE = Path(__file__).parent
_MODULE = "module client\n\ngo 1.21\n\nrequire github.com/bluenviron/gomavlib/v3 v3.1.0\n"
_ITEMS = 20


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack).bench()


def installed(command: list[str], folder: Path, **variables: str) -> None:
    """Install or build; the test is skipped if the registry cannot be reached."""
    done = subprocess.run(
        command, cwd=folder, env=os.environ | variables, capture_output=True, text=True, timeout=600, check=False
    )
    if done.returncode:
        pytest.skip(f"NOT RUN: {' '.join(command[:3])} failed: {done.stderr.strip()[-200:]}")


def result(command: list[str], **variables: str) -> str:
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_gomavlib_writes_and_reads_a_mission_and_all_parameters(bench: Bench, tmp_path: Path) -> None:
    go = shutil.which("go", path=f"{os.environ['PATH']}:/usr/local/go/bin")
    if go is None:
        pytest.skip("NOT RUN: needs go")
    folder = tmp_path / "client"
    folder.mkdir()
    (folder / "go.mod").write_text(_MODULE)
    shutil.copy(_HERE / "gomavlib_client.go", folder / "main.go")
    # Without optimization and C, as a new machine compiles Go's own library, too.
    build = [go, "build", "-gcflags=all=-N -l", "-ldflags=-s -w", "-o", "client", "."]
    installed(build, folder, GOFLAGS="-mod=mod", CGO_ENABLED="0")
    client = [str(folder / "client"), f"127.0.0.1:{bench.daemon.port}", str(_ITEMS)]
    assert result(client) == f"0 {_ITEMS} 237 237"
    assert len(bench.board.records()) == _ITEMS


def test_mavsdk_3_writes_and_reads_a_mission_and_a_parameter(bench: Bench, tmp_path: Path) -> None:
    folder = tmp_path / "packages"
    installed([sys.executable, "-m", "pip", "install", "-q", "--target", str(folder), "mavsdk==3.17.4"], tmp_path)
    ports = str(bench.daemon.port), str(free_port(socket.SOCK_STREAM))
    client = [sys.executable, str(_HERE / "mavsdk3_client.py"), ports[0], str(_ITEMS), ports[1]]
    assert result(client, PYTHONPATH=str(folder)) == f"{_ITEMS} 200.0"
    assert len(bench.board.records()) == _ITEMS
