# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner's own code, which is not in this repository: MISSION_PLANNER is the path of its sources."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.benches import Starter
from tests.support.lossy_udp import LossyUdp
from tests.support.planner_sources import compile_planner
from tests.support.programs import Board, free_port
from tests.support.real_planner import RealPlanner


class Session(NamedTuple):
    """A connected Mission Planner, and the simulated board behind its daemon."""

    planner: RealPlanner
    board: Board


Sessions = Callable[..., Session]


@pytest.fixture(scope="session")
def planner_program(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The compiled program, and the sources."""
    path = os.environ.get("MISSION_PLANNER")
    if not path:
        pytest.skip("NOT RUN: needs Mission Planner's sources: MISSION_PLANNER=path/to/its/repository")
    if not (shutil.which("mcs") and shutil.which("mono")):
        pytest.skip("NOT RUN: needs mono: apt install mono-mcs mono-runtime libmono-cil-dev")
    return compile_planner(Path(path), tmp_path_factory.mktemp("planner")), Path(path)


@pytest.fixture
def session(planner_program: tuple[Path, Path], tmp_path: Path) -> Iterator[Sessions]:
    """Starts a session with a board of these options; `link`: the faults of a LossyUdp. `state`: of the daemon then."""
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)

        def begin(*options: str, link: dict[str, float] | None = None, state: str = "MSP") -> Session:
            planner = stack.enter_context(RealPlanner(*planner_program, tmp_path, free_port()))
            port = planner.port
            if link is not None:
                port = stack.enter_context(LossyUdp(("127.0.0.1", port), **link)).address[1]
            board = start.board(*options)
            start.daemon(str(board.link), (f"udpout:127.0.0.1:{port}",)).wait(state)
            planner.connect()
            return Session(planner, board)

        yield begin
