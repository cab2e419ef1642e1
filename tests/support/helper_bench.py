# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon with its page, and the root helper on a machine made of files."""

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Thread

import pytest

from service.cli.helper.action import ThisPi
from service.cli.helper.serve import answer
from tests.support.benches import Starter
from tests.support.fixable_pi import FixablePi
from tests.support.web_bench import WebBench, web_daemon


@contextmanager
def helper_bench(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[WebBench, FixablePi]]:
    """The page's daemon with a board, and the machine that its helper changes."""
    pi = FixablePi(directory / "root", monkeypatch)
    runtime = directory / "state"  # the daemon's, where tests look for its control socket
    runtime.mkdir()
    with socket.socket(socket.AF_UNIX) as listening, ExitStack() as stack:
        listening.bind(f"{runtime}-helper.sock")
        listening.listen()
        Thread(target=_serve, args=(listening, pi, directory / "lock"), daemon=True).start()
        start = Starter(directory, stack)
        board = start.board()
        with monkeypatch.context() as patch:
            patch.setenv("RUNTIME_DIRECTORY", str(runtime))
            bench = web_daemon(start, str(board.link))
            yield WebBench(bench.daemon, board, bench.port), pi
        listening.shutdown(socket.SHUT_RDWR)


def _serve(listening: socket.socket, pi: FixablePi, lock: Path) -> None:
    while True:
        try:
            connection, _ = listening.accept()
        except OSError:
            return  # closed
        with connection, connection.makefile("rb") as body:
            answer(connection, ThisPi(pi, body), {os.geteuid()}, lock)
