# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that use a flight controller directly (`--fc`), and faults outside naze-bridge."""

import json
import pwd
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from click.testing import CliRunner

from service.cli.main import main
from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.benches import Starter
from tests.support.programs import Board, run_naze_bridge


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Board]:
    with ExitStack() as stack:
        yield Starter(tmp_path, stack).board()


def test_status_waits_for_telemetry(tmp_path: Path) -> None:
    """At 9600 baud a round of polls takes longer than identifying the flight controller."""
    with ExitStack() as stack:
        board = Starter(tmp_path, stack).board("--baud", "9600")
        status = json.loads(run_naze_bridge("status", "--json", "--fc", f"{board.link},9600").stdout)
    assert (status["armed"], status["mission_records"], status["speed_baud"]) == (False, 0, 9600)
    assert status["battery_v"] > 9
    assert status["satellites"] > 4


def test_a_missing_port_is_reported_in_one_sentence(tmp_path: Path) -> None:
    assert_one_sentence(run_naze_bridge("status", "--fc", tmp_path / "naze"), 1, "is missing", str(tmp_path))


def test_a_tcp_port_without_a_listener_is_reported_in_one_sentence() -> None:
    assert_one_sentence(
        run_naze_bridge("pull", "--fc", "tcp:127.0.0.1:9"),
        1,
        "9 cannot be reached: Connection refused; is it switched on, and is the port right?",
    )


def test_an_unknown_host_is_reported_in_one_sentence() -> None:
    advice = "check the name and the network"
    assert_one_sentence(run_naze_bridge("pull", "--fc", "tcp:[fe80::1%no-card]:9"), 1, advice)


# -- the machine ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [["status"], ["missions", "list"], ["run", "--fc", "sim:"]])
def test_a_user_without_a_home_is_pointed_to_the_state_dir_option(
    monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    def unknown_user(uid: int) -> None:
        raise KeyError(uid)

    monkeypatch.setattr(pwd, "getpwuid", unknown_user)
    for name in ("HOME", "XDG_STATE_HOME", "STATE_DIRECTORY"):
        monkeypatch.delenv(name, raising=False)
    ended = CliRunner().invoke(main, command)
    assert ended.exit_code == 2
    assert ended.stderr.splitlines()[0].startswith("naze-bridge: this user has no home folder")
    assert "--state-dir" in ended.stderr
