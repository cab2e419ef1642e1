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
from service.machine.helper_socket import UNITS
from tests.support.benches import Starter
from tests.support.fixable_pi import FixablePi
from tests.support.web_bench import WebBench, web_daemon


@contextmanager
def helper_bench(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[WebBench, FixablePi]]:
    """The page's daemon with a board, and the machine that its helper changes."""
    pi = FixablePi(directory / "root", monkeypatch)
    runtime = directory / "state"  # the daemon's, where tests look for its control socket
    runtime.mkdir()
    (directory / "lock").touch()
    with ExitStack() as stack:
        for unit in UNITS:
            listening = stack.enter_context(socket.socket(socket.AF_UNIX))
            listening.bind(str(runtime.with_name(f"naze-bridge-helper-{unit}.sock")))
            listening.listen()
            stack.callback(listening.shutdown, socket.SHUT_RDWR)
            Thread(target=_serve, args=(listening, pi, directory / "lock", unit), daemon=True).start()
        start = Starter(directory, stack)
        board = start.board()
        with monkeypatch.context() as patch:
            patch.setenv("RUNTIME_DIRECTORY", str(runtime))
            bench = web_daemon(start, str(board.link))
            yield WebBench(bench.daemon, board, bench.port), pi


def _serve(listening: socket.socket, pi: FixablePi, lock: Path, unit: str) -> None:
    while True:
        try:
            connection, _ = listening.accept()
        except OSError:
            return  # closed
        with connection, connection.makefile("rb") as body:
            answer(connection, ThisPi(pi, body), {os.geteuid()}, lock, unit)
