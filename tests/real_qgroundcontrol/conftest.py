# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's own code, which is not in this repository.

QGROUNDCONTROL is the path of its sources, MAVLINK that of MAVLink's C headers (mavlink/c_library_v2).
"""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.benches import Starter
from tests.support.lossy_udp import LossyUdp
from tests.support.programs import Board, free_port
from tests.support.qgc_sources import compile_qgc, missing_packages
from tests.support.real_qgc import RealQgc


class Session(NamedTuple):
    """A connected QGroundControl, and the simulated board behind its daemon."""

    qgc: RealQgc
    board: Board


Sessions = Callable[..., Session]


@pytest.fixture(scope="session")
def qgc_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path, mavlink = os.environ.get("QGROUNDCONTROL"), os.environ.get("MAVLINK")
    if not (path and mavlink):
        pytest.skip("NOT RUN: needs sources: QGROUNDCONTROL=path/to/its/repository MAVLINK=path/to/c_library_v2")
    if not shutil.which("g++") or missing_packages():
        pytest.skip(
            "NOT RUN: needs Qt: apt install g++ qt6-base-dev qt6-declarative-dev qt6-positioning-dev qt6-scxml-dev"
        )
    return compile_qgc(Path(path), Path(mavlink), tmp_path_factory.mktemp("qgc"))


@pytest.fixture
def session(qgc_program: Path, tmp_path: Path) -> Iterator[Sessions]:
    """Starts a session with a board of these options; `link`: the faults of a LossyUdp. `state`: of the daemon then."""
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)

        def begin(*options: str, link: dict[str, float] | None = None, state: str = "MSP") -> Session:
            qgc = stack.enter_context(RealQgc(qgc_program, tmp_path, free_port()))
            port = qgc.port
            if link is not None:
                port = stack.enter_context(LossyUdp(("127.0.0.1", port), **link)).address[1]
            board = start.board(*options)
            start.daemon(str(board.link), (f"udpout:127.0.0.1:{port}",)).wait(state)
            qgc.connect()
            return Session(qgc, board)

        yield begin
