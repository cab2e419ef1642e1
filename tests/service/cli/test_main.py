# SPDX-License-Identifier: GPL-3.0-or-later
"""The program as a whole: what it loads, and faults of its output."""

import os
import resource
import subprocess
import sys
from pathlib import Path

from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.programs import run_naze_bridge

EXAMPLES = Path(__file__).parents[3] / "examples"


def test_a_full_disk_behind_standard_output_is_reported_in_one_sentence(tmp_path: Path) -> None:
    def leave_100_bytes() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    with (tmp_path / "output").open("w") as output:
        ended = run_naze_bridge("check", EXAMPLES / "long-146.waypoints", stdout=output, preexec_fn=leave_100_bytes)
    assert_one_sentence(ended, os.EX_IOERR, "cannot be written", "File too large")


def test_a_full_disk_behind_the_log_does_not_stop_the_program(tmp_path: Path) -> None:
    def leave_nothing() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    script = (
        "import structlog; from service.machine.log_setup import set_up_logging; set_up_logging('info');"
        "[structlog.get_logger().warning('a.line') for _ in range(3)]; print('goes on')"
    )
    with (tmp_path / "log").open("w") as log:
        ended = subprocess.run(
            [sys.executable, "-c", script],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            preexec_fn=leave_nothing,
            check=False,
        )
    assert (ended.returncode, ended.stdout) == (0, "goes on\n")


def test_a_closed_pipe_is_not_reported() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    ended = run_naze_bridge("check", EXAMPLES / "long-146.waypoints", stdout=writing)
    os.close(writing)
    assert ended.stderr == ""


def test_a_daemon_does_not_load_libraries_of_commands() -> None:
    """A Pi may have only 512 MB."""
    script = (
        "import sys, click; from service.cli.main import main; main.get_command(click.Context(main), 'run');"
        "print(*sorted({'rich', 'pygments', 'zenoh', 'starlette', 'prometheus_client'} & set(sys.modules)))"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ended.stdout == "\n"


def test_help_does_not_load_the_daemon_or_large_libraries() -> None:
    """Each takes a noticeable part of a second on a Pi."""
    script = (
        "import sys, click; from service.cli.main import main; context = click.Context(main); main.get_help(context);"
        "print(*sorted({'asyncio', 'bridge', 'rich', 'service.settings'} & set(sys.modules)));"
        "[main.get_command(context, name).get_help(context) for name in main.list_commands(context)];"
        "print(*sorted({'service.daemon.daemon', 'starlette'} & set(sys.modules)))"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ended.stdout == "\n\n"
