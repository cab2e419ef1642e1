# SPDX-License-Identifier: GPL-3.0-or-later
"""How `naze-bridge fleet` connects, and its messages on failure."""

import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import free_port, run_naze_bridge
from tests.support.zenoh_router import EXAMPLES, Router, running_router


@pytest.fixture(scope="module")
def router(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Router]:
    with running_router(tmp_path_factory.mktemp("router")) as router:
        yield router


def sentence_of(*arguments: str | Path, code: int = 1) -> str:
    ended = run_naze_bridge("fleet", *arguments)
    assert (ended.returncode, ended.stdout) == (code, ""), ended
    if code == 1:
        assert len(ended.stderr.splitlines()) == 1, ended.stderr
    return ended.stderr.splitlines()[-1]


def test_an_empty_fleet_is_reported(router: Router) -> None:
    listed = run_naze_bridge("fleet", "list", "--connect", router.endpoint)
    assert (listed.returncode, listed.stdout) == (0, "No vehicle is alive under 'fleet'.\n")
    pushed = sentence_of("push", EXAMPLES / "naze-field.waypoints", "--all", "--connect", router.endpoint)
    assert "no vehicle is alive under 'fleet'" in pushed


def test_the_first_endpoint_to_answer_is_used(router: Router) -> None:
    dead = f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    listed = run_naze_bridge("fleet", "list", "--connect", dead, "--connect", router.endpoint)
    assert listed.returncode == 0, listed


def test_a_missing_router_is_reported_in_one_sentence() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    reason = f"{endpoint}: no router is running there (connection refused)"
    assert sentence_of("list", "--connect", endpoint) == f"naze-bridge: cannot join the fleet: {reason}"


def test_another_program_on_the_routers_port_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert "is a zenoh router" in sentence_of("list", "--connect", endpoint)


def test_a_file_that_is_not_a_mission_is_not_sent(tmp_path: Path) -> None:
    file = tmp_path / "plan"
    file.write_text("I am no mission")
    ended = run_naze_bridge("fleet", "push", file, "--all")
    assert ended.returncode == 2
    assert re.fullmatch(r"naze-bridge: .*plan.*\n", ended.stderr), ended.stderr


def test_an_unusable_name_is_reported_in_one_sentence() -> None:
    reason = sentence_of("enroll", "my plane", code=2)
    assert reason.startswith("naze-bridge: the name is 'my plane': use at most 64 letters")


def test_an_unusable_folder_is_reported_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    reason = sentence_of("enroll", "kite", "--folder", tmp_path / "file")
    assert reason.endswith("members.json cannot be read: Not a directory")
