# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet logs`: a vehicle's logs arrive whole, also after an interruption, and within the rate."""

import json
import random
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from fleet.logs import Log, fetch_log
from service.recording.tlog_recorder import TLOG_FOLDER
from tests.support.fleet_bench import Fleet
from tests.support.programs import Program, until
from tests.support.zenoh_bench import I_KNOW

NAME = "2026-05-01 10-00-00 flight.tlog"
#: Half of it cannot be compressed.
CONTENT = random.Random(1).randbytes(100_000) + bytes(100_000)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with ExitStack() as stack:
        fleet = Fleet(tmp_path_factory.mktemp("fleet"), stack)
        for name, commands in (("kite", I_KNOW), ("owl", "")):
            logs = fleet.folder / name / "state" / TLOG_FOLDER
            logs.mkdir(parents=True)
            (logs / NAME).write_bytes(CONTENT)
            fleet.start(name, commands=commands)
        fleet.wait("kite", "owl")
        yield fleet


def test_a_log_is_listed_and_fetched(fleet: Fleet, tmp_path: Path) -> None:
    listed = fleet.ask("logs", "--vehicle", "kite", "--json")
    assert json.loads(listed.stdout)["logs"] == [{"vehicle": "kite", "name": NAME, "size": len(CONTENT)}]
    fetched = fleet.ask("logs", "--vehicle", "kite", NAME, "--folder", tmp_path, "--rate", "1000")
    assert fetched.returncode == 0, fetched
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {f"kite {NAME}": CONTENT}


def test_an_interrupted_fetch_continues(fleet: Fleet, tmp_path: Path) -> None:
    partial = tmp_path / f"kite {NAME}.part"
    where = ("--folder", str(tmp_path), "--connect", fleet.router.endpoint)
    slow = Program(tmp_path / "fetch.log", "fleet", "logs", "--vehicle", "kite", NAME, "--rate", "1", *where)
    try:
        until(lambda: partial.exists() and partial.stat().st_size, "the first piece")
    finally:
        slow.end()
    begun = partial.stat().st_size
    assert begun < len(CONTENT)
    sizes: list[int] = []
    path = tmp_path / f"kite {NAME}"
    fetch_log(fleet.session, "fleet", Log("kite", NAME, len(CONTENT)), path, 1e6, sizes.append)
    assert path.read_bytes() == CONTENT
    assert (sizes[0], sum(sizes)) == (begun, len(CONTENT))


def test_a_fetch_keeps_to_the_rate(fleet: Fleet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(time, "sleep", pauses.append)
    fetch_log(fleet.session, "fleet", Log("kite", NAME, len(CONTENT)), tmp_path / NAME, 1000, lambda _: None)
    # 100 kB that cannot be compressed are 133 kB in base64.
    assert sum(pauses) == pytest.approx(133, rel=0.1)


def test_an_unavailable_log_is_reported_in_one_sentence(fleet: Fleet, tmp_path: Path) -> None:
    unknown = fleet.ask("logs", "--vehicle", "kite", "2020-01-01 00-00-00.tlog", "--folder", tmp_path)
    assert (unknown.returncode, "kite has no log '2020-01-01 00-00-00.tlog'" in unknown.stderr) == (1, True)
    closed = fleet.ask("logs", "--vehicle", "owl")
    assert (closed.returncode, "owl: accepts no commands" in closed.stderr) == (1, True)
    for two in ("kite", "owl"), ():
        unclear = fleet.ask("logs", *(part for name in two for part in ("--vehicle", name)), NAME)
        assert (unclear.returncode, "name it with one --vehicle" in unclear.stderr) == (2, True)


def test_the_logs_of_several_vehicles_are_listed(fleet: Fleet) -> None:
    fleet.start("emu", commands=I_KNOW)
    fleet.wait("kite", "emu")
    listed = fleet.ask("logs")
    assert (listed.returncode, listed.stdout) == (1, f"kite: {NAME}  200 kB\n")  # owl refuses
    assert "emu has no telemetry logs\n" in listed.stderr
    assert "naze-bridge: owl: accepts no commands" in listed.stderr
    assert list(json.loads(fleet.ask("logs", "--json").stdout)["errors"]) == ["owl"]
