# SPDX-License-Identifier: GPL-3.0-or-later
"""The program as its shell sees it: Ctrl-C while it starts, works and exits; closed standard streams."""

import os
import pty
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.support.programs import NAZE_BRIDGE, REPOSITORY, TIMEOUT_S

MISSION = REPOSITORY / "examples" / "naze-field.waypoints"
#: Runs the program, with SIGINT at a known moment: the import of a module, or the exit of the interpreter.
WITH_CTRL_C = """
import atexit, os, signal, sys

moment = sys.argv.pop(1)

class AtImport:
    def find_spec(self, name, path=None, target=None):
        if name == moment:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, AtImport())
if moment == "exit":
    atexit.register(os.kill, os.getpid(), signal.SIGINT)
from service.cli.program import start
start()
"""
#: Runs the program, and prints the targets of its standard streams to a file.
WITH_STREAMS = """
import atexit, os, sys

path = sys.argv.pop(1)
atexit.register(lambda: open(path, "w").write(" ".join(os.readlink(f"/proc/self/fd/{each}") for each in range(3))))
from service.cli.program import start
start()
"""


def run(program: str, *arguments: str | Path, before: Callable[[], object] | None = None) -> Any:
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=REPOSITORY, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=TIMEOUT_S,
        preexec_fn=before,
    )  # fmt: skip


def with_sigint(handler: signal.Handlers) -> Callable[[], object]:
    """As in a shell's foreground (SIG_DFL) or background (SIG_IGN), wherever the tests run."""
    return lambda: signal.signal(signal.SIGINT, handler)


@pytest.mark.parametrize(
    ("moment", "code", "said"),
    [
        ("click", -signal.SIGINT, ""),
        ("service.cli.main", -signal.SIGINT, ""),
        ("service.cli.check", 130, "\nnaze-bridge: interrupted\n"),
        ("exit", -signal.SIGINT, ""),
    ],
)
def test_ctrl_c_ends_it_without_a_traceback(moment: str, code: int, said: str) -> None:
    ended = run(WITH_CTRL_C, moment, "check", MISSION, before=with_sigint(signal.SIG_DFL))
    assert (ended.returncode, ended.stderr) == (code, said)


def test_an_ignored_ctrl_c_stays_ignored() -> None:
    ended = run(WITH_CTRL_C, "click", "check", MISSION, before=with_sigint(signal.SIG_IGN))
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_question_without_an_answer_is_reported_in_one_sentence(tmp_path: Path) -> None:
    ended = run("from service.cli.program import start; start()", "setup", "--root", tmp_path)
    assert ended.returncode == 1
    said = "standard input ended before the question" if os.geteuid() == 0 else "setup needs root"
    assert ended.stderr.splitlines()[-1].startswith(f"naze-bridge: {said}")


@pytest.mark.parametrize(("no_color", "has_colours"), [("", True), ("1", False)])
def test_no_color_is_respected_on_a_terminal(no_color: str, has_colours: bool) -> None:
    """no-color.org: set and not empty."""
    master, terminal = pty.openpty()
    command = [*NAZE_BRIDGE, "check", str(MISSION)]
    subprocess.run(command, cwd=REPOSITORY, stdout=terminal, env=os.environ | {"NO_COLOR": no_color}, check=True)
    os.close(terminal)
    printed = os.read(master, 80)
    os.close(master)
    assert (b"\x1b[" in printed) == has_colours


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_stream_is_replaced_by_dev_null(closed: str, tmp_path: Path) -> None:
    """Otherwise the serial port could become descriptor 2, and a library's error message would go to the aircraft."""
    found = tmp_path / "streams"
    command = [sys.executable, "-c", WITH_STREAMS, str(found), "check", str(MISSION)]
    ended = subprocess.run(
        ["sh", "-c", f'exec "$@" {closed}', "sh", *command],
        cwd=REPOSITORY, stdin=subprocess.PIPE, capture_output=True,
        check=False,
    )  # fmt: skip
    assert (ended.returncode, ended.stderr) == (0, b"")
    streams = found.read_text().split()
    assert [stream == "/dev/null" for stream in streams] == [sign in closed.split() for sign in ("<&-", ">&-", "2>&-")]


@pytest.mark.parametrize("encoding", ["latin-1", "cp1251"])
def test_prints_a_file_name_that_the_terminals_encoding_lacks(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "Flug \u98de \N{AIRPLANE}.waypoints"
    file.write_bytes(MISSION.read_bytes())
    done = subprocess.run(
        [*NAZE_BRIDGE, "check", file],
        env=os.environ | {"PYTHONIOENCODING": encoding}, capture_output=True, check=False, timeout=TIMEOUT_S,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"Flug ? ?.waypoints" in done.stdout
