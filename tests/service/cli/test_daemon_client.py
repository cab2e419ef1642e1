# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon that is missing, another user's, or taken over."""

import socket
import subprocess
import sys
from pathlib import Path
from threading import Thread

from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.programs import Daemon, run_naze_bridge


def test_a_missing_daemon_is_one_sentence(tmp_path: Path) -> None:
    assert_one_sentence(run_naze_bridge("status", "--state-dir", tmp_path), 1, str(tmp_path), "naze-bridge run")


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
