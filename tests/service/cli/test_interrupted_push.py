# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C in `push`, typed at a terminal while records are being written."""

import fcntl
import os
import pty
import re
import signal
import subprocess
import termios
from contextlib import suppress
from pathlib import Path

from tests.support.benches import Starter
from tests.support.programs import NAZE_BRIDGE, REPOSITORY, TIMEOUT_S, Board, run_naze_bridge, until

EXAMPLES = REPOSITORY / "examples"
LONG = EXAMPLES / "long-146.waypoints"
CTRL_C = b"\x03"
#: By now some of the records are written.
UNDER_WAY = r"[1-9][0-9]*/146"


def slow_board(start: Starter) -> Board:
    """A board that takes 5 s to write 146 records."""
    return start.board("--baud", "9600")


class Terminal:
    """A command in its own terminal, so that Ctrl-C works however the tests were started."""

    def __init__(self, *arguments: str | Path) -> None:
        self._master, slave = pty.openpty()

        def control_terminal() -> None:
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)
            signal.signal(signal.SIGINT, signal.SIG_DFL)

        self._process = subprocess.Popen(
            [*NAZE_BRIDGE, *map(str, arguments)],
            cwd=REPOSITORY, stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
            preexec_fn=control_terminal, env=os.environ | {"TERM": "xterm", "COLUMNS": "200"},
        )  # fmt: skip
        os.close(slave)
        self.printed = ""

    def type(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def wait_for(self, pattern: str) -> None:
        while not re.search(pattern, self.printed):
            self.printed += self._read()

    def end(self) -> int:
        with suppress(OSError):  # the terminal ends with its last program
            while True:
                self.printed += self._read()
        os.close(self._master)
        return self._process.wait(TIMEOUT_S)

    def _read(self) -> str:
        return os.read(self._master, 4096).decode(errors="replace")


def test_without_a_daemon_the_old_mission_is_kept(start: Starter) -> None:
    board = slow_board(start)
    fc = f"{board.link},9600"
    assert run_naze_bridge("push", EXAMPLES / "naze-field.waypoints", "--fc", fc).returncode == 0
    before = board.records()
    assert before
    terminal = Terminal("push", LONG, "--fc", fc)
    terminal.wait_for(UNDER_WAY)
    terminal.type(CTRL_C)
    assert terminal.end() == 130
    assert "Not written: naze-bridge stopped, old one kept" in terminal.printed
    assert board.records() == before
    board.assert_unharmed()


def test_a_daemon_continues_after_the_command_has_ended(start: Starter) -> None:
    board = slow_board(start)
    daemon = start.daemon(f"{board.link},9600")
    daemon.wait()
    terminal = Terminal("push", LONG, "--state-dir", daemon.state_dir)
    terminal.wait_for(UNDER_WAY)
    terminal.type(CTRL_C)
    assert terminal.end() == 130
    assert "naze-bridge: interrupted; the daemon continues" in terminal.printed
    until(lambda: daemon.has_logged("mission.push_ended") and len(board.records()) == 146, "the whole mission")
