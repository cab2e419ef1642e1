# SPDX-License-Identifier: GPL-3.0-or-later
"""Test benches: programs started for a test and ended with it, also when it fails."""

import signal
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from tests.support.lossy_udp import LossyUdp
from tests.support.mission_planner import MissionPlanner
from tests.support.programs import Board, Daemon, Program

P = TypeVar("P", bound=Program)


@dataclass(frozen=True)
class Bench:
    """A daemon that has found the simulated board on a pty; more programs can be added."""

    board: Board
    daemon: Daemon
    stack: ExitStack

    def mission_planner(self, address: tuple[str, int] | None = None) -> MissionPlanner:
        """A connected Mission Planner."""
        planner = self.stack.enter_context(MissionPlanner(address or self.daemon.address))
        planner.skip_connecting()
        return planner

    def lossy_link(self, **faults: float) -> LossyUdp:
        """A bad link to the daemon; `faults` are the arguments of LossyUdp."""
        return self.stack.enter_context(LossyUdp(self.daemon.address, **faults))


class Starter:
    """Starts programs with their files in `directory`."""

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        self.directory = directory
        self._stack = stack

    def board(self, *options: str, tcp: bool = False) -> Board:
        board = self._ended_at_last(Board(self.directory, *options, tcp=tcp))
        board.wait()
        return board

    def daemon(
        self,
        fc: str,
        gcs: Sequence[str] = (),
        state_dir: Path | None = None,
        options: Sequence[str] = (),
        config: str = "",
    ) -> Daemon:
        return self._ended_at_last(Daemon(self.directory, fc, gcs, state_dir, options, config))

    def key_file(self, words: str = "loop the loop") -> Path:
        """A file with a key for signing, which only its owner may read."""
        path = self.directory / "gcs.key"
        path.write_text(f"{words}\n")
        path.chmod(0o600)
        return path

    def program(self, name: str, *arguments: str) -> Program:
        """Start another subcommand; its output goes to a file of that name."""
        return self._ended_at_last(Program(self.directory / name, *arguments))

    def bench(self, *options: str, gcs: Sequence[str] = (), config: str = "") -> Bench:
        """A board with `options`, and a daemon that has found it."""
        board = self.board(*options)
        daemon = self.daemon(str(board.link), gcs, config=config)
        daemon.wait()
        return Bench(board, daemon, self._stack)

    def _ended_at_last(self, program: P) -> P:
        self._stack.callback(program.end, signal.SIGKILL)
        return program
