# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon with a status page and a simulated board."""

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from email.message import Message
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

from tests.support.benches import Starter
from tests.support.programs import TIMEOUT_S, Board, Daemon, free_port, run_naze_bridge, until

EXAMPLE = Path(__file__).parents[2] / "examples" / "naze-field.waypoints"


@dataclass(frozen=True)
class Answer:
    """A response of the page's server."""

    status: int
    headers: Message
    body: bytes

    @property
    def data(self) -> Any:
        return json.loads(self.body)


class WebBench:
    """The daemon, its board (None: the built-in one), and a browser's requests."""

    def __init__(self, daemon: Daemon, board: Board | None, port: int) -> None:
        self.daemon = daemon
        self.board = board
        self.port = port

    @property
    def token(self) -> str:
        return (self.daemon.state_dir / "web-token").read_text().strip()

    def ask(self, path: str, method: str = "GET", **headers: str) -> Answer:
        """Send a request until the server accepts it; tests send more than a page does."""
        return until(lambda: self.ask_once(path, method, **headers), "an answer")

    def post(self, path: str, body: bytes, **headers: str) -> Answer:
        return until(lambda: self._ask_once(path, "POST", body, headers), "an answer")

    def ask_once(self, path: str, method: str = "GET", **headers: str) -> Answer | None:
        """Send a request; None if the server is at its connection limit."""
        return self._ask_once(path, method, None, headers)

    def _ask_once(self, path: str, method: str, body: bytes | None, headers: dict[str, str]) -> Answer | None:
        connection = HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT_S)
        try:
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read())
        except ConnectionError:
            return None
        finally:
            connection.close()

    def state(self) -> dict[str, Any]:
        state: dict[str, Any] = self.ask("/api/state").data
        return state

    def restore(self, number: int) -> dict[str, Any]:
        """Restore a mission like the page; return the result."""
        answer = self.ask(f"/api/missions/{number}/restore", "POST", Authorization=f"Bearer {self.token}")
        assert answer.status == 202, answer
        ended: dict[str, Any]
        ended = until(lambda: (state := self.state()["write"])["done"] and state, "the end of the restore")
        return ended

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), TIMEOUT_S)

    def push_example(self) -> None:
        """Write a list with many changed items."""
        ended = run_naze_bridge("push", "--state-dir", self.daemon.state_dir, EXAMPLE)
        assert ended.returncode == 0, ended.stderr


def web_daemon(start: Starter, fc: str = "sim:", web: str = "", *, has_board: bool = True) -> WebBench:
    """Start a daemon with a page; `web`: further lines of its table. Waits for the board, if any."""
    port = free_port(socket.SOCK_STREAM)
    config = start.directory / "naze-bridge.toml"
    config.write_text(f'[web]\nlisten = "127.0.0.1:{port}"\n{web}')
    daemon = start.daemon(fc, options=("--config", str(config)))
    if has_board:
        daemon.wait()
    until(lambda: daemon.has_logged("web.listening"), "the page")
    return WebBench(daemon, None, port)


@contextmanager
def web_bench(directory: Path) -> Iterator[WebBench]:
    """A daemon that has found a board behind a pseudo-terminal."""
    with ExitStack() as stack:
        start = Starter(directory, stack)
        board = start.board()
        bench = web_daemon(start, str(board.link))
        yield WebBench(bench.daemon, board, bench.port)
        board.assert_unharmed()
