# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon that is missing, another user's, or taken over."""

import os
import pty
import socket
import subprocess
import sys
from pathlib import Path
from threading import Thread

import pytest

from protocols.mission_item import Command
from service.cli.daemon_client import BridgeClient
from tests.service.cli.test_mission_commands import ask, assert_one_sentence, write_plan
from tests.support.plan import HOME, PlanRow, plain_plan
from tests.support.programs import Daemon, run_naze_bridge


def test_a_missing_daemon_is_reported_in_one_sentence(tmp_path: Path) -> None:
    assert_one_sentence(run_naze_bridge("status", "--state-dir", tmp_path), 1, str(tmp_path), "naze-bridge run")


def test_a_board_cannot_act_on_the_terminal_without_a_daemon_either(monkeypatch: pytest.MonkeyPatch) -> None:
    async def answer(*_: object, **__: object) -> dict[str, object]:
        return {"settings": [{"name": "a\x1b[2J"}], "values": {"b\x9b": "c\u202e"}}

    monkeypatch.setattr("service.cli.direct_bridge.ask_directly", answer)
    held = BridgeClient(None, as_json=False, fc="sim:").ask({"do": "settings"})
    assert held == {"settings": [{"name": "a[2J"}], "values": {"b": "c"}}


def test_a_daemon_that_was_taken_over_cannot_act_on_the_terminal(tmp_path: Path) -> None:
    answers = [b'{"error": "\\u001b[2J\\u009b2J"}', b"[" * 100_000, b"[]", b"\xff", b"{}"]
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "control.sock"))
        listening.listen()

        def answer_all() -> None:
            for answer in answers:
                with listening.accept()[0] as client:
                    client.recv(4096)
                    client.sendall(answer + b"\n")

        answering = Thread(target=answer_all)
        answering.start()
        for _ in answers:
            ended = run_naze_bridge("status", "--state-dir", tmp_path)
            assert_one_sentence(ended, 1)
            assert ended.stderr.rstrip("\n").isprintable()
        answering.join()


def test_another_users_daemon_is_reported_as_such(daemon: Daemon) -> None:
    """As root, the daemon's directory is root's; otherwise it is the tester's own with no permissions."""
    as_nobody = (
        "import os; from service.cli.main import main; import service.cli.status, service.settings;"
        "os.geteuid() or os.setuid(65534); main(prog_name='naze-bridge')"
    )
    daemon.state_dir.chmod(0)
    try:
        ended = subprocess.run(
            [sys.executable, "-c", as_nobody, "status", "--state-dir", str(daemon.state_dir)],
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        daemon.state_dir.chmod(0o755)
    assert_one_sentence(ended, 1, "no permission", "sudo", "group", str(daemon.state_dir))


def test_a_list_that_would_erase_the_mission_needs_confirmation(daemon: Daemon, tmp_path: Path) -> None:
    ask(daemon, "push", write_plan(tmp_path / "plan", plain_plan(7, start=20)))
    held = daemon.pull()["records"]
    nothing = write_plan(tmp_path / "nothing", [HOME, PlanRow(Command.DO_CHANGE_SPEED)])
    refused = ask(daemon, "push", nothing)
    assert refused.returncode == 3
    assert "would erase the mission" in refused.stdout
    assert daemon.pull()["records"] == held
    assert ask(daemon, "push", "--erase", nothing).returncode == 0
    assert daemon.pull()["records"] == []


@pytest.mark.parametrize(("typed", "code", "left"), [(b"n\n", 3, 7), (b"\n", 3, 7), (b"y\n", 0, 0)])
def test_a_person_at_a_terminal_is_asked_before_the_mission_is_erased(
    daemon: Daemon, tmp_path: Path, typed: bytes, code: int, left: int
) -> None:
    ask(daemon, "push", write_plan(tmp_path / "plan", plain_plan(7, start=20)))
    nothing = write_plan(tmp_path / "nothing", [HOME, PlanRow(Command.DO_CHANGE_SPEED)])
    terminal, far_end = pty.openpty()
    try:
        os.write(terminal, typed)
        ended = ask(daemon, "push", nothing, stdin=far_end)
    finally:
        os.close(terminal)
        os.close(far_end)
    assert "Erase it? [y/N]" in ended.stderr
    assert ended.returncode == code, ended
    assert len(daemon.pull()["records"]) == left
